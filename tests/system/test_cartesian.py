"""Paths of the tool over a real daemon on simcan, judged from the log alone.

Forward kinematics is pinocchio's on the DH rows of the logged cell file, put together here: nothing of the planner.
"""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pinocchio
import pytest
from numpy.typing import NDArray

from axisync_client import Client, ErrorCode, Lease, Move, Refused, deg, moves
from axisync_client.moves import AnyMove
from axisync_schemas.cell import Group, Pose
from axisync_schemas.replies import MoveReply
from support import logcheck
from support.daemon import eod_text, patient, running
from support.logread import Log, logs_in, read_log

Array = NDArray[np.float64]
T = TypeVar("T")

ACROSS = deg(75, -10, 20, -55, 145, -35)
"""KingKong reaching over the body; WuKong cannot come past."""
OVER = deg(-115, 40, -35, 65, 45, -20)
DOWN = (0.0, 1.0, 0.0, 0.0)
CORNERS = {"A": (-0.2719, 0.157, 0.3), "B": (-0.2719, 0.157, 0.1), "C": (-0.3484, 0.23, 0.3), "D": (-0.3484, 0.23, 0.1)}
ORDER = "ABACDC"
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


def placement(pose: Pose) -> Any:
    roll, pitch, yaw = pose.rpy
    return pinocchio.SE3(pinocchio.rpy.rpyToMatrix(roll, pitch, yaw), np.array(pose.position))


def chain(group: Group) -> Any:
    """A pinocchio model of the DH rows: Rz(theta) Tz(d) Tx(a) Rx(alpha) for each."""
    model, at, parent = pinocchio.Model(), placement(group.base), 0
    for axis in group.axes:
        row = axis.dh
        assert row is not None
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), at, axis.name)
        turn = pinocchio.rpy.rpyToMatrix(row.alpha, 0.0, 0.0)
        at = pinocchio.SE3(turn, np.array([row.a, 0.0, row.d]))
        assert row.theta == 0.0
    model.addFrame(pinocchio.Frame("tool", parent, at * placement(group.tool), pinocchio.FrameType.OP_FRAME))
    return model


def tool_of(log: Log, positions: Array) -> Array:
    """[k, 4, 4] KingKong's tool in O at logged positions [k, axes]."""
    model = chain(log.cell.groups[0])
    data = model.createData()
    found = []
    for q in positions[:, :6]:
        pinocchio.framesForwardKinematics(model, data, np.array(q))
        found.append(data.oMf[model.getFrameId("tool")].homogeneous)
    return np.array(found)


def ticks_of(recorded: Recorded, reply: MoveReply) -> Any:
    plan_id = int((reply.move_id or "")[2:])
    ticks = recorded.log.ticks
    return ticks[ticks["plan_id"][:, 0] == plan_id]


def off_line(points: Array, begin: Array, end: Array) -> float:
    along = (end - begin) / np.linalg.norm(end - begin)
    offsets = points - begin
    inside = np.clip(offsets @ along, 0.0, np.linalg.norm(end - begin))
    return float(np.linalg.norm(offsets - inside[:, None] * along, axis=1).max())


def test_the_log_keeps_every_promise(recorded: Recorded) -> None:
    """Velocity, acceleration and jerk by differences of logged positions, among others."""
    assert logcheck.problems(recorded.log) == []


def test_the_line_is_straight(recorded: Recorded) -> None:
    tool = tool_of(recorded.log, ticks_of(recorded, recorded.line)["position"])
    base = placement(recorded.log.cell.groups[0].base).homogeneous
    begin, end = tool[0, :3, 3], tool[0, :3, 3] + base[:3, 2] * 0.05
    assert off_line(tool[:, :3, 3], begin, end) < 1e-5
    assert np.linalg.norm(tool[-1, :3, 3] - end) < 1e-4
    assert np.abs(tool[:, :3, :3] - tool[0, :3, :3]).max() < 1e-5


def test_the_tool_change_reaches_its_corners(recorded: Recorded) -> None:
    rows = ticks_of(recorded, recorded.change)
    tool = tool_of(recorded.log, rows["position"])
    path_s = rows["path_s"][:, 0]
    ends = [step.begins_s for step in recorded.change.steps[3:]] + [recorded.change.duration_s]
    for name, end in zip(ORDER, ends, strict=True):
        pose = tool[int(np.abs(path_s - end).argmin())]
        assert np.linalg.norm(pose[:3, 3] - CORNERS[name]) < 1e-4
        assert np.abs(pose[:3, :3] - np.diag([-1.0, 1.0, -1.0])).max() < 1e-3


def test_the_tool_change_is_straight_between_them(recorded: Recorded) -> None:
    rows = ticks_of(recorded, recorded.change)
    tool = tool_of(recorded.log, rows["position"])[:, :3, 3]
    path_s = rows["path_s"][:, 0]
    lines = [step for step in recorded.change.steps if step.kind == "linear"]
    names = [(a, b) for a, b in itertools.pairwise(ORDER) if a + b != "AC"]
    assert len(lines) == len(names) == 4
    for step, (begin, end) in zip(lines, names, strict=True):
        points = tool[(path_s > step.begins_s) & (path_s < step.begins_s + step.duration_s)]
        assert len(points) > 500
        assert off_line(points, np.array(CORNERS[begin]), np.array(CORNERS[end])) < 1e-5


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
