"""Five straight lines of KingKong: how long they take in this planner, and in TOPP-RA at the same joint limits."""

import json
import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Cell
from axisync_schemas.commands import MoveRequest
from axisync_schemas.internal import PlanJob
from axisync_schemas.replies import MoveReply
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import plan_move

Array = NDArray[np.float64]

GROUP = "kingkong"
WAYPOINTS = 201
"""Of the joint path, as TOPP-RA gets it: positions evenly spaced along it, joined by cubic splines."""
GRID = 1001
"""Where TOPP-RA looks at limits."""
SAMPLES = 20_001


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line: start in degrees, and a move as a request has it."""

    name: str
    start: tuple[float, ...]
    move: dict[str, Any]


def _along(x: float, y: float, z: float, **options: object) -> dict[str, Any]:
    return {"kind": "linear", "relative": True, "frame": "body", "target": {"position": [x, y, z]}, **options}


PAPER = {
    "position": [-0.0928, -0.2528, 0.38],
    "euler_zyz": [math.radians(x) for x in (120.0, 120.0, -160.0)],
}
ABOVE = (-133.0, -116.0, -89.0, -123.0, 52.0, -21.0)
TURNED = {"position": [0.0, 0.0, 0.06], "quaternion": [0.0, 0.0, 0.5, math.sqrt(0.75)]}
FIRST, SIDE = (0.0, -150.0, 60.0, -45.0, -45.0, 45.0), (-60.0, -120.0, 80.0, -60.0, -90.0, 0.0)
LINES = (
    Line(
        "V.B.2 of the paper",
        (-90.0, -150.0, 45.0, -90.0, -90.0, -90.0),
        {"kind": "linear", "target": PAPER, "orientation": "euler_zyz"},
    ),
    Line("100 mm down, near A", ABOVE, _along(0.0, 0.0, -0.1)),
    Line("150 mm across", SIDE, _along(0.15, 0.0, 0.0)),
    Line("20 mm up", SIDE, _along(0.0, 0.0, 0.02)),
    Line(
        "60 mm, turning by 60 deg",
        FIRST,
        {"kind": "linear", "relative": True, "frame": "tool", "target": TURNED},
    ),
)


@dataclass(frozen=True, slots=True)
class Durations:
    """Of one line, s.

    Attributes:
        planned: as it is asked for, path limits of the cell file too; scale: by how much it was stretched.
        joints: without path limits, as fast as the joints' limits let the same curve be.
        no_jerk: the same without the joints' jerk limits.
        toppra: time-optimal along the same joint path without jerk limits; None without the package.
    """

    name: str
    planned: float
    scale: float
    joints: float
    no_jerk: float
    toppra: float | None


def planned(models: Models, line: Line) -> tuple[MoveReply, Trajectory]:
    """The line as the planner plans it, everything included."""
    return plan_of_request(models, GROUP, line.move, np.radians(line.start))


def plan_of_request(
    models: Models, group: str, move: dict[str, Any], start: Array | None
) -> tuple[MoveReply, Trajectory]:
    """A move as a request has it, from `start` [n], rad, or from where the emulated drives stand at first."""
    request = MoveRequest.model_validate_json(json.dumps({"group": group, "move": move}))
    rest = np.array([axis.drive.start for axis in models.cell.axes])
    axes = list(models.cell.axis_indices(group))
    if start is not None:
        rest[axes] = start
    job = PlanJob(
        ref=1, group=group, plan_id=1, slot=0, start=tuple(rest[axes].tolist()), rest=tuple(rest.tolist()),
        move=request.move, speed_scale=1.0,
    )  # fmt: skip
    result = plan_move(models, job)
    assert result.plan is not None
    plan = result.plan
    return result.reply, Trajectory(plan.knots, plan.coefficients, plan.start, plan.end)


def durations(models: Models) -> list[Durations]:
    """Of all lines."""
    retime = toppra_of(models.cell)
    found = []
    for line in LINES:
        reply, trajectory = planned(models, line)
        _, v, a, j = trajectory.sample(np.linspace(0.0, trajectory.duration, SAMPLES))
        limits = limits_of(models.cell)
        used = [float((np.abs(x) / limit).max()) for x, limit in zip((v, a, j), limits, strict=True)]
        slower = [share ** (1.0 / order) for order, share in enumerate(used, 1)]
        found.append(
            Durations(
                line.name, reply.duration_s, reply.scale, trajectory.duration * max(slower),
                trajectory.duration * max(slower[:2]), retime(waypoints(trajectory)) if retime else None,
            )
        )  # fmt: skip
    return found


def limits_of(cell: Cell) -> Array:
    """[3, n]: velocity, acceleration and jerk of each joint."""
    axes = [cell.axes[i].limits for i in cell.axis_indices(GROUP)]
    return np.array([(axis.velocity, axis.acceleration, axis.jerk) for axis in axes]).T


def waypoints(trajectory: Trajectory) -> Array:
    """[WAYPOINTS, n] positions evenly spaced along the joint path, whatever the timing."""
    q = trajectory.sample(np.linspace(0.0, trajectory.duration, SAMPLES))[0]
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    places = np.linspace(0.0, travelled[-1], WAYPOINTS)
    return np.stack([np.interp(places, travelled, column) for column in q.T], axis=1)


def toppra_of(cell: Cell) -> Callable[[Array], float] | None:
    """What gives the shortest duration (s) of a joint path [k, n] within velocity and acceleration limits."""
    try:
        toppra = import_module("toppra")
    except ImportError:
        return None
    logging.getLogger("toppra").setLevel(logging.ERROR)
    velocity, acceleration, _ = limits_of(cell)
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]

    def duration(path: Array) -> float:
        spline = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(path)), path)
        solver = toppra.algorithm.TOPPRA(limits, spline, gridpoints=np.linspace(0.0, 1.0, GRID))
        return float(solver.compute_trajectory(0.0, 0.0).duration)

    return duration
