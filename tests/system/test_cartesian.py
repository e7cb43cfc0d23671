"""Paths of the tool over a real daemon on simcan, judged from the log alone."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pytest

from axisync_client import Client, ErrorCode, Lease, Move, Refused, deg, moves
from axisync_client.moves import AnyMove
from axisync_schemas.replies import MoveReply
from support import logcheck
from support.cells import eod_text
from support.daemon import patient, running
from support.logread import Log, logs_in, read_log
from support.tool_path import CORNERS, DOWN, off_corners, off_line, off_lines, placement, ticks_of, tool_of

T = TypeVar("T")

ACROSS = deg(75, -10, 20, -55, 145, -35)
"""KingKong reaching over the body; WuKong cannot come past."""
OVER = deg(-115, 40, -35, 65, 45, -20)
MOVE_S = 120.0


def tool_change() -> Any:
    """V.C.2 of the paper: from its via points to A, down to B and back, to C, down to D and back."""

    def over(name: str) -> Any:
        return moves.joint(moves.pose(CORNERS[name], DOWN), frame="body")

    def line(name: str) -> Any:
        return moves.linear(moves.pose(CORNERS[name], DOWN), frame="body")

    ready = [moves.joint(deg(-90, -150, 45, -90, -90, -90)), moves.joint(deg(-133, -116, -89, -123, 52, -21))]
    return [*ready, over("A"), line("B"), line("A"), over("C"), line("D"), line("C")]


@dataclass
class Recorded:
    """What was answered, and the log."""

    log: Log
    line: MoveReply
    change: MoveReply
    refused: Refused
    admitted: MoveReply
    wire: dict[str, Refused]


def refusal(ask: Any, *arguments: Any, **options: Any) -> Refused:
    with pytest.raises(Refused) as caught:
        ask(*arguments, **options)
    return caught.value


def patiently(ask: Callable[[], T]) -> T:
    """Asks again where the planner had no time, and was started anew: other work may share the machine."""
    for _ in range(3):
        try:
            return ask()
        except Refused as refused:
            if refused.code not in (ErrorCode.INTERNAL, ErrorCode.UNAVAILABLE):
                raise
            time.sleep(15.0)
    return ask()


def begun(lease: Lease, move: AnyMove, group: str = "kingkong", speed: float = 1.0) -> Move:
    return patiently(lambda: lease.move(move, group=group, speed_scale=speed))


def not_planned(client: Client, move: AnyMove) -> Refused:
    return refusal(patiently, lambda: client.plan("kingkong", move))


def crossing(lease: Lease) -> tuple[Refused, MoveReply]:
    """While KingKong comes back, WuKong's way is not free; when it has, it is."""
    begun(lease, moves.joint(ACROSS)).result(MOVE_S)
    back = begun(lease, moves.joint(deg(0, -150, 60, -45, -45, 45)))
    over = moves.joint(OVER)
    refused = refusal(begun, lease, over, "wukong", 0.5)
    back.result(MOVE_S)
    goes = begun(lease, over, "wukong", 0.5)
    lease.stop("wukong")
    goes.wait(MOVE_S)
    return refused, goes.reply


def on_the_wire(client: Client) -> dict[str, Refused]:
    fast = moves.linear((0.0, 0.0, 0.05), relative=True, linear_limits=(1.0, 2.0, 3.0), retime=False)
    return {
        "far": not_planned(client, moves.linear((2.0, 0.0, 0.0))),
        "fast": not_planned(client, fast),
        "step": not_planned(client, moves.sequence([moves.dwell(0.1), moves.linear((2.0, 0.0, 0.0))])),
    }


def arms_alone() -> str:
    """Without the body: drives of a patient cell may run on too far by themselves to be let near it at full speed."""
    text = patient(eod_text())
    return text[: text.index("[geometry]")] + "[geometry]\nmargin_m = 0.005\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    with running(tmp_path_factory.mktemp("cartesian"), arms_alone()) as daemon:
        with Client(daemon.endpoint, timeout_s=30.0) as client, client.lease("both", ttl_s=10.0) as lease:
            lease.enable()
            line = begun(lease, moves.linear((0.0, 0.0, 0.05), relative=True))
            line.result(MOVE_S)
            refused, admitted = crossing(lease)
            change = begun(lease, moves.sequence(tool_change()))
            change.result(MOVE_S)
            wire = on_the_wire(client)
        assert daemon.stop() == 0, daemon.output
        return Recorded(read_log(*logs_in(daemon.log_dir)), line.reply, change.reply, refused, admitted, wire)


def test_the_log_keeps_every_promise(recorded: Recorded) -> None:
    """Velocity, acceleration and jerk by differences of logged positions, among others."""
    assert logcheck.problems(recorded.log) == []


def test_the_line_is_straight(recorded: Recorded) -> None:
    tool = tool_of(recorded.log, ticks_of(recorded.log, recorded.line)["position"])
    base = placement(recorded.log.cell.groups[0].base).homogeneous
    begin, end = tool[0, :3, 3], tool[0, :3, 3] + base[:3, 2] * 0.05
    assert off_line(tool[:, :3, 3], begin, end) < 1e-5
    assert np.linalg.norm(tool[-1, :3, 3] - end) < 1e-4
    assert np.abs(tool[:, :3, :3] - tool[0, :3, :3]).max() < 1e-5


def test_the_tool_change_reaches_its_corners(recorded: Recorded) -> None:
    distance, turn = off_corners(recorded.log, recorded.change)
    assert distance < 1e-4
    assert turn < 1e-3


def test_the_tool_change_is_straight_between_them(recorded: Recorded) -> None:
    assert off_lines(recorded.log, recorded.change, samples=500) < 1e-5


def test_two_arms_do_not_share_space_while_one_moves(recorded: Recorded) -> None:
    assert recorded.refused.code is ErrorCode.COLLISION
    assert recorded.refused.details["fix"] == {"group": "both"}
    assert {name.split()[0] for name in recorded.refused.details["pair"]} == {"kingkong", "wukong"}
    assert recorded.admitted.move_id is not None
    assert recorded.admitted.min_distance_m is not None


def test_refusals_come_with_numbers(recorded: Recorded) -> None:
    wire = recorded.wire
    assert (wire["far"].code, wire["step"].code) == (ErrorCode.UNREACHABLE, ErrorCode.UNREACHABLE)
    assert wire["far"].details["distance_m"] > 1.0
    assert wire["step"].details["step"] == 1
    assert wire["fast"].code is ErrorCode.JOINT_LIMIT
    assert 0.0 < wire["fast"].details["max_feasible_speed_scale"] < 1.0
    assert all(math.isfinite(value) for value in wire["far"].details["nearest_reachable"]["position"])
