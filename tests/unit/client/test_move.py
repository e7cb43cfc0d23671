import threading
import time

import numpy as np
import pytest

from axisync_client import (
    Client,
    Lease,
    LeaseLost,
    Lissajous,
    MoveFailed,
    MoveHeld,
    MoveStatus,
    MoveStopped,
    MoveTimedOut,
    Program,
    Refused,
    Unavailable,
    deg,
    mm,
    moves,
)
from support.cell_peer import Peer

STEP = deg(5, 0, 0, 0, 0, 0)


@pytest.fixture
def arm(client: Client) -> Lease:
    lease = client.lease("kingkong")
    lease.enable()
    return lease


def end_later(peer: Peer, status: MoveStatus, delay_s: float = 0.1) -> None:
    threading.Timer(delay_s, lambda: peer.end(peer.moves["m-1"], status, "because")).start()


def test_a_move_arrives(arm: Lease) -> None:
    move = arm.move_joint(STEP, relative=True, duration_s=0.4)
    assert (move.id, move.group, move.reply.duration_s) == ("m-1", "kingkong", 0.4)
    assert 0.0 <= move.progress() < 1.0
    assert move.wait().status is MoveStatus.SUCCEEDED
    assert move.result().progress == 1.0
    assert move.progress() == 1.0


def test_what_a_move_asks_for(arm: Lease, peer: Peer) -> None:
    arm.move_joint(np.zeros(6), minimise="jerk", pulse="parabolic", speed_scale=0.5, duration_s=60.0)
    verb, _, body = peer.requests[-1]
    assert verb == "move"
    assert (body["speed_scale"], body["move"]["minimise"], body["move"]["pulse"]) == (0.5, "jerk", "parabolic")
    assert body["not_after_s"] == pytest.approx(time.monotonic() + 5.0, abs=1.0)


def test_moves_of_every_kind(client: Client, peer: Peer) -> None:
    with client.lease("both") as arms:
        arms.enable()
        one = {"group": "kingkong"}
        arms.move_linear({"kingkong": mm(0, 0, 50), "wukong": mm(0, 0, 50)}, relative=True)
        arms.move_circular(mm(1, 1, 0), mm(2, 0, 0), **one)
        arms.move_path(Lissajous(amplitude=(0.1, 0.1, 0.0), frequency=(1.0, 2.0, 0.0)), **one)
        arms.move_sequence([moves.dwell(0.1)], **one, speed_scale=0.5)
        arms.run_program(Program(name="wait", group="wukong", move=moves.sequence([moves.dwell(0.1)])))
        arms.move(moves.linear(mm(1, 0, 0)), **one)
    sent = [(body["group"], body["move"]["kind"]) for verb, _, body in peer.requests if verb == "move"]
    assert sent == [
        ("both", "linear"), ("kingkong", "circular"), ("kingkong", "path"), ("kingkong", "sequence"),
        ("wukong", "sequence"), ("kingkong", "linear"),
    ]  # fmt: skip
    assert all(body["lease"] for verb, _, body in peer.requests if verb == "move")


def test_a_disabled_group_refuses(client: Client) -> None:
    with client.lease("kingkong") as lease, pytest.raises(Refused) as caught:
        lease.move_joint(STEP)
    assert (caught.value.code, caught.value.details["group"]) == ("NOT_ENABLED", "kingkong")


@pytest.mark.parametrize(
    ("status", "error"),
    [(MoveStatus.STOPPED, MoveStopped), (MoveStatus.FAILED, MoveFailed), (MoveStatus.HELD, MoveHeld)],
)
def test_other_endings_are_reported_and_raised(
    arm: Lease, peer: Peer, status: MoveStatus, error: type[Exception]
) -> None:
    move = arm.move_joint(STEP, relative=True, duration_s=30.0)
    end_later(peer, status)
    report = move.wait(timeout_s=10.0)
    assert (report.status, report.reason) == (status, "because")
    with pytest.raises(error, match="because"):
        move.result()


def test_a_held_move_can_be_waited_through(arm: Lease, peer: Peer) -> None:
    move = arm.move_joint(STEP, relative=True, duration_s=30.0)
    end_later(peer, MoveStatus.HELD, 0.0)
    with pytest.raises(MoveTimedOut, match="m-1 of kingkong"):
        move.wait(0.3, through_held=True)


def test_stop_ends_it(arm: Lease) -> None:
    move = arm.move_joint(STEP, relative=True, duration_s=30.0)
    assert move.stop().groups == {"kingkong": "standstill"}
    with pytest.raises(MoveStopped):
        move.result(5.0)


def test_updates_lead_to_the_end(arm: Lease) -> None:
    reports = list(arm.move_joint(STEP, relative=True, duration_s=0.4).updates(period_s=0.02))
    progress = [report.progress for report in reports]
    assert len(progress) > 3
    assert progress == sorted(progress)
    assert reports[-1].status is MoveStatus.SUCCEEDED


def test_waiting_notices_that_the_lease_is_lost(client: Client, peer: Peer) -> None:
    arm = client.lease("kingkong", ttl_s=0.3)
    arm.enable()
    move = arm.move_joint(STEP, relative=True, duration_s=30.0)
    peer.leases.clear()
    with pytest.raises(LeaseLost):
        move.wait(10.0)


def test_waiting_notices_that_the_daemon_is_gone(arm: Lease, peer: Peer) -> None:
    move = arm.move_joint(STEP, relative=True, duration_s=30.0)
    peer.close()
    with pytest.raises((Unavailable, LeaseLost)):
        move.wait(30.0)
    peer.open()
