"""The tool's path in a log, and how far it is from the paper's tool change (V.C.2).

Forward kinematics is pinocchio's on the DH rows of the logged cell file, put together here: nothing of the planner.
"""

import itertools
from typing import Any

import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisync_schemas.cell import Group, Pose
from axisync_schemas.replies import MoveReply
from support.logread import Log

Array = NDArray[np.float64]

CORNERS = {"A": (-0.2719, 0.157, 0.3), "B": (-0.2719, 0.157, 0.1), "C": (-0.3484, 0.23, 0.3), "D": (-0.3484, 0.23, 0.1)}
"""Of the tool change, in O, m."""
ORDER = "ABACDC"
DOWN = (0.0, 1.0, 0.0, 0.0)
"""How the tool is turned there: a quaternion."""


def placement(pose: Pose) -> Any:
    """As pinocchio has it."""
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


def ticks_of(log: Log, reply: MoveReply) -> Any:
    """The ticks in which this move of KingKong's was under way."""
    plan_id = int((reply.move_id or "")[2:])
    return log.ticks[log.ticks["plan_id"][:, 0] == plan_id]


def off_line(points: Array, begin: Array, end: Array) -> float:
    """m, the farthest of the points from the stretch between two."""
    along = (end - begin) / np.linalg.norm(end - begin)
    offsets = points - begin
    inside = np.clip(offsets @ along, 0.0, np.linalg.norm(end - begin))
    return float(np.linalg.norm(offsets - inside[:, None] * along, axis=1).max())


def off_corners(log: Log, reply: MoveReply) -> tuple[float, float]:
    """How far the tool is from A to D at the ends of the tool change's steps: m, and an element of the rotation."""
    rows = ticks_of(log, reply)
    path_s, tool = rows["path_s"][:, 0], tool_of(log, rows["position"])
    ends = [step.begins_s + step.duration_s for step in reply.steps if step.kind != "dwell"][-len(ORDER) :]
    poses = [tool[int(np.abs(path_s - end).argmin())] for end in ends]
    distances = [np.linalg.norm(pose[:3, 3] - CORNERS[name]) for name, pose in zip(ORDER, poses, strict=True)]
    turns = [np.abs(pose[:3, :3] - np.diag([-1.0, 1.0, -1.0])).max() for pose in poses]
    return float(max(distances)), float(max(turns))


def off_lines(log: Log, reply: MoveReply, samples: int) -> float:
    """m, how far the tool is off the straight lines of the tool change; each has at least so many ticks."""
    rows = ticks_of(log, reply)
    tool = tool_of(log, rows["position"])[:, :3, 3]
    path_s = rows["path_s"][:, 0]
    lines = [step for step in reply.steps if step.kind == "linear"]
    names = [(a, b) for a, b in itertools.pairwise(ORDER) if a + b != "AC"]
    found = []
    for step, (begin, end) in zip(lines, names, strict=True):
        points = tool[(path_s > step.begins_s) & (path_s < step.begins_s + step.duration_s)]
        assert len(points) >= samples
        found.append(off_line(points, np.array(CORNERS[begin]), np.array(CORNERS[end])))
    return max(found)
