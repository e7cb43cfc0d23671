"""`Lease.jog`: asks again and again while its block runs, and lets go on every way out."""

import time

import pytest

from axisync_client import Client, InvalidArgument, LeaseLost, Refused, deg
from axisync_schemas.errors import ErrorCode, Refusal
from support.cell_peer import Peer

SLOW, BACK = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0), (-0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


def asked(peer: Peer) -> list[list[float]]:
    return [body["velocity"] for verb, _, body in peer.requests if verb == "jog"]


def wait_until(what: object, timeout_s: float = 10.0) -> None:
    end = time.monotonic() + timeout_s
    while not what():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.01)


def test_it_is_asked_for_again_and_again_and_let_go(client: Client, peer: Peer) -> None:
    with client.lease("kingkong") as lease:
        with lease.jog("kingkong", velocity=SLOW) as motion:
            assert motion.reply is not None
            assert motion.reply.state == "moving"
            wait_until(lambda: len(asked(peer)) > 5)
            motion.velocity = BACK
            wait_until(lambda: list(BACK) in asked(peer))
        motion.check()
        count = len(asked(peer))
        assert asked(peer)[-1] == [0.0] * 6
        time.sleep(0.3)
        assert len(asked(peer)) == count
        assert client.state()


def test_every_request_has_a_time_of_its_own(client: Client, peer: Peer) -> None:
    with client.lease("kingkong") as lease, lease.jog(space="tool", velocity=(0.01, 0, 0), ttl_s=0.5):
        wait_until(lambda: len(asked(peer)) > 2)
    bodies = [body for verb, _, body in peer.requests if verb == "jog"]
    assert {body["space"] for body in bodies} == {"tool"}
    assert {body["ttl_s"] for body in bodies} == {0.5}
    assert len({body["request_id"] for body in bodies}) == len(bodies)
    assert all(body["not_after_s"] <= time.monotonic() + 0.5 for body in bodies)


def test_let_go_when_an_error_leaves_the_block(client: Client, peer: Peer) -> None:
    with pytest.raises(ZeroDivisionError), client.lease("kingkong") as lease, lease.jog(velocity=SLOW):
        raise ZeroDivisionError
    assert asked(peer)[-1] == [0.0] * 6


def test_what_is_refused_never_begins(client: Client, peer: Peer) -> None:
    peer.refusals["jog"] = Refusal(ErrorCode.SOFT_LIMIT, "at its limit", fix="jog the other way")
    with client.lease("kingkong") as lease, pytest.raises(Refused, match="jog the other way"), lease.jog(velocity=SLOW):
        raise AssertionError("the block does not begin")


def test_no_way_on_is_no_end(client: Client, peer: Peer) -> None:
    with client.lease("kingkong") as lease, lease.jog(velocity=SLOW) as motion:
        peer.refusals["jog"] = Refusal(ErrorCode.COLLISION, "too near")
        wait_until(lambda: motion.blocked is not None)
        motion.check()
        del peer.refusals["jog"]
        wait_until(lambda: motion.blocked is None)


def jogged(client: Client, peer: Peer, refusal: Refusal | None) -> None:
    with client.lease("kingkong") as lease, lease.jog(velocity=SLOW) as motion:
        if refusal is not None:
            peer.refusals["jog"] = refusal
        else:
            peer.leases.clear()
        motion.sleep(10.0)
        raise AssertionError("the sleep ends early")


def test_a_stop_by_somebody_else_is_told(client: Client, peer: Peer) -> None:
    with pytest.raises(Refused, match="stopped while"):
        jogged(client, peer, Refusal(ErrorCode.WRONG_STATE, "kingkong was stopped while it was jogged"))


def test_a_lost_lease_is_told(client: Client, peer: Peer) -> None:
    with pytest.raises(LeaseLost):
        jogged(client, peer, None)


@pytest.mark.parametrize(
    ("velocity", "ttl_s"), [((), 0.2), ((float("nan"),) * 6, 0.2), (("x",), 0.2), (SLOW, 0.0), (SLOW, 30.0)]
)
def test_what_no_daemon_would_take(client: Client, peer: Peer, velocity: tuple[float, ...], ttl_s: float) -> None:
    lease = client.lease("kingkong")
    with pytest.raises(InvalidArgument):
        lease.jog(velocity=velocity, ttl_s=ttl_s)
    assert asked(peer) == []


def test_another_number_of_values(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong")
    with lease.jog(velocity=deg(1, 0, 0, 0, 0, 0)) as motion, pytest.raises(InvalidArgument, match="6 are expected"):
        motion.velocity = (0.1,)
