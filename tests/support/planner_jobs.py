"""Jobs for the planner, without a service: the demo cell with its shapes, and without."""

import math
import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import TypeAdapter

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import parse_cell, read_cell
from axisync_schemas.errors import Refusal
from axisync_schemas.internal import PlanJob
from axisync_schemas.moves import Move
from axisync_schemas.plan_slots import Plan
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import Planned, plan_move
from support.arms import EOD

Array = NDArray[np.float64]
Pose = dict[str, Any]

MOVE: TypeAdapter[Any] = TypeAdapter(Move)
CELL, TEXT = read_cell(EOD)
FREE_TEXT = re.sub(r"(?m)^radius_m = .*$", "", TEXT)
"""Nothing can collide."""
MODELS, FREE = Models(CELL), Models(parse_cell(FREE_TEXT))
REST = tuple(axis.drive.start for axis in CELL.axes)
LIMITS = np.radians([30.0, 40.0, 80.0])
"""Of every joint: velocity, acceleration, jerk."""


def degrees(*values: float) -> tuple[float, ...]:
    return tuple(map(math.radians, values))


P1 = degrees(0, -150, 60, -45, -45, 45)
P2 = degrees(-90, -100, -45, -110, 45, 45)
PAPER = degrees(-90, -150, 45, -90, -90, -90)
"""Where the line of V.B.2 begins."""
WUKONG = REST[6:]


def job(
    move: Any, start: tuple[float, ...] = P1, group: str = "kingkong", slot: int | None = 0, **fields: Any
) -> PlanJob:
    """A move as a model, or as a request has it."""
    made = MOVE.validate_python(move, strict=False) if isinstance(move, dict) else move
    rest: dict[str, Any] = {"ref": 1, "plan_id": 7, "speed_scale": 1.0, "rest": REST} | fields
    return PlanJob(group=group, slot=slot, start=start, move=made, **rest)


def planned(move: Any, models: Models = FREE, others: tuple[Plan, ...] = (), **fields: Any) -> Planned:
    return plan_move(models, job(move, **fields), others)


def refused(move: Any, models: Models = FREE, others: tuple[Plan, ...] = (), **fields: Any) -> Refusal:
    with pytest.raises(Refusal) as caught:
        planned(move, models, others, **fields)
    return caught.value


def plan_of(result: Planned) -> Plan:
    assert result.plan is not None
    return result.plan


def trajectory_of(result: Planned) -> Trajectory:
    plan = plan_of(result)
    return Trajectory(plan.knots, plan.coefficients, plan.start, plan.end)


def at(position: Any, **orientation: Any) -> Pose:
    """A pose as a request has it."""
    return {"position": tuple(map(float, position)), **orientation}


def linear(target: Any, **options: Any) -> dict[str, Any]:
    pose = target if isinstance(target, dict) else at(target)
    return {"kind": "linear", "target": pose, **options}


def by(x: float, y: float, z: float, **options: Any) -> dict[str, Any]:
    """A line by that much."""
    return linear((x, y, z), relative=True, **options)


def dense(trajectory: Trajectory, count: int = 2000) -> Array:
    """Times [k], with some within every piece, however short."""
    inner = [trajectory.knots[:-1] + share * np.diff(trajectory.knots) for share in (0.0, 0.25, 0.5, 0.75, 0.999)]
    return np.unique(np.concatenate([np.linspace(0.0, trajectory.duration, count)[:-1], *inner]))


def tool_of(result: Planned, group: str = "kingkong", columns: slice = slice(None)) -> tuple[Array, Array]:
    """Dense times [k], and the tool's poses [k, 4, 4] in O there."""
    (member,) = (member for member in FREE.members(group))
    trajectory = trajectory_of(result)
    times = dense(trajectory)
    return times, member.kinematics().placements(trajectory.sample(times)[0][:, columns])


def usage(trajectory: Trajectory) -> Array:
    """[3] the highest velocity, acceleration and jerk of any joint, as shares of their limits."""
    _, *derivatives = trajectory.sample(dense(trajectory))
    return np.array([np.abs(values).max() for values in derivatives]) / LIMITS


def jumps(trajectory: Trajectory) -> Array:
    """[4] the largest jumps at knots of position, velocity, acceleration and jerk, the rests at both ends included."""
    c, widths = trajectory.coefficients, np.diff(trajectory.knots)
    after, before = np.zeros((4, len(widths) + 1, c.shape[2])), np.zeros((4, len(widths) + 1, c.shape[2]))
    before[0, 0], after[0, -1] = trajectory.start, trajectory.end
    for k in range(4):
        factors = np.array([math.perm(power, k) for power in range(c.shape[1])])[k:, None]
        powers = widths[:, None] ** np.arange(c.shape[1] - k)
        before[k, 1:] = np.einsum("mp,mpn->mn", powers, c[:, k:] * factors)
        after[k, :-1] = math.factorial(k) * c[:, k]
    found: Array = np.abs(after - before).max(axis=(1, 2))
    return found
