import time

import pytest

from axisync_client import AxisyncError, Client, InvalidArgument, Lease, LeaseLost, Refused, deg
from support.cell_peer import Peer


def wait_until(what: object, timeout_s: float = 5.0) -> None:
    end = time.monotonic() + timeout_s
    while not what():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.01)


def actions(peer: Peer) -> list[str]:
    return [body["action"] for verb, _, body in peer.requests if verb == "lease"]


def test_acquired_renewed_and_given_back(client: Client, peer: Peer) -> None:
    with client.lease("kingkong", ttl_s=0.3) as lease:
        time.sleep(0.8)  # several lives of the lease
        assert not lease.lost
        lease.enable()
    assert actions(peer)[0] == "acquire"
    assert actions(peer)[-1] == "release"
    assert actions(peer).count("renew") >= 3
    assert not peer.leases


def test_enable_disable_and_reset(client: Client, peer: Peer) -> None:
    with client.lease("both") as lease:
        assert lease.enable().groups == {"kingkong": "standstill", "wukong": "standstill"}
        assert lease.disable("wukong").groups == {"wukong": "disabled"}
        assert lease.reset("kingkong").groups == {"kingkong": "disabled"}


def test_a_held_group_names_the_holder(client: Client, peer: Peer) -> None:
    with client.lease("kingkong"), Client(peer.endpoint, user="bob") as other:
        with pytest.raises(Refused, match="kingkong is held by anonymous") as caught:
            other.lease("all")
        assert caught.value.code == "LEASE_HELD"


def test_a_lease_that_is_taken_is_lost_loudly(client: Client, peer: Peer) -> None:
    told: list[tuple[Lease, LeaseLost]] = []
    with Client(peer.endpoint, user="bob") as other:
        lease = client.lease("kingkong", ttl_s=0.3, on_lost=lambda *what: told.append(what))
        with other.lease("kingkong", take=True):
            wait_until(lambda: lease.lost)
            with pytest.raises(LeaseLost, match="lapsed, was released or taken over"):
                lease.move_joint(deg(*[0] * 6))
            lease.stop()  # needs none
    wait_until(lambda: told)
    assert [what[0] for what in told] == [lease]
    count = len(peer.requests)
    lease.release()
    assert len(peer.requests) == count, "a lost lease is not given back"


def test_a_command_under_a_lost_lease_notices_at_once(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong", ttl_s=60.0)
    peer.leases.clear()
    with pytest.raises(LeaseLost):
        lease.enable()
    assert lease.lost


def test_a_loss_nobody_noticed_is_raised_at_the_end_of_the_block(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong", ttl_s=0.3)
    peer.leases.clear()
    wait_until(lambda: lease.lost)
    with pytest.raises(LeaseLost), lease:
        pass


def test_an_error_in_the_block_is_not_hidden_by_the_loss(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong", ttl_s=0.3)
    peer.leases.clear()
    wait_until(lambda: lease.lost)
    with pytest.raises(ZeroDivisionError), lease:
        _ = 1 / 0


def test_a_daemon_that_dies_ends_the_lease_at_its_time(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong", ttl_s=0.5)
    peer.close()
    wait_until(lambda: lease.lost)
    with pytest.raises(LeaseLost, match="nobody answers"):
        lease.enable()
    peer.open()


def test_several_groups_need_a_name(client: Client, peer: Peer) -> None:
    with client.lease(["kingkong", "wukong"]) as lease:
        with pytest.raises(InvalidArgument, match=r"kingkong, wukong.*group="):
            lease.enable()
        assert lease.enable("wukong").groups == {"wukong": "standstill"}
        assert set(lease.stop().groups) == {"kingkong", "wukong"}


def test_a_released_lease_is_of_no_use(client: Client) -> None:
    lease = client.lease("kingkong")
    lease.release()
    lease.release()
    with pytest.raises(LeaseLost, match="was given back"):
        lease.enable()


def test_closing_the_client_gives_leases_back(peer: Peer) -> None:
    client = Client(peer.endpoint)
    client.lease("kingkong")
    client.lease("wukong")
    client.close()
    assert not peer.leases


def test_a_release_without_an_answer_is_no_error(client: Client, peer: Peer) -> None:
    lease = client.lease("kingkong")
    peer.deaf["lease"] = 99
    with lease:
        pass
    assert not lease.lost
    with pytest.raises(AxisyncError):
        lease.enable()
