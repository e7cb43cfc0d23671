"""Plans again what was asked for, and compares with what was planned then."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_review.pieces import Piece, Run
from axisync_review.playing import path_of
from axisync_review.replay import read_story
from axisync_schemas.base import Strict
from axisync_schemas.errors import Refusal
from axisync_schemas.internal import PlanJob
from axisync_schemas.log_models import PlanLog
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import plan_move

Array = NDArray[np.float64]

TOLERANCE = 1e-12
"""rad: two machines, or two backends of the planner, may differ in the last digits."""


class Replanned(Strict):
    """One plan. `error` is the greatest distance of positions at ticks, rad; `reason`: why it could not be planned."""

    move_id: str | None
    group: str
    same: bool
    error: float | None
    reason: str | None = None


def replan(models: Models, plan: PlanLog, rest: tuple[float, ...]) -> Trajectory:
    """The trajectory for the logged request, from the logged start; `rest` [all axes] is where everything stood.

    Raises:
        Refusal: it cannot be planned now.
        ValueError: the logged move is not one that this version knows.
    """
    fields = {
        "ref": 0, "group": plan.group, "plan_id": plan.plan_id, "slot": 0, "start": plan.start, "rest": rest,
        "move": plan.move, "speed_scale": plan.speed_scale,
    }  # fmt: skip
    job = PlanJob.model_validate_json(json.dumps(fields))  # JSON, so that lists become tuples under strict types
    planned = plan_move(models, job).plan
    if planned is None:
        raise ValueError("nothing moves")
    return Trajectory(planned.knots, planned.coefficients, planned.start, planned.end)


def replan_all(paths: Sequence[Path]) -> list[Replanned]:
    """Every logged plan that has its polynomials.

    Raises:
        LogUnreadable: see `Run`.
    """
    story, cell = read_story(paths)
    rests = _rests(paths)
    home = tuple(axis.drive.start for axis in cell.axes)
    models = Models(cell)
    return [_compare(models, plan, rests.get(plan.plan_id, home)) for plan in story.plans.values() if plan.knots]


def _compare(models: Models, plan: PlanLog, rest: tuple[float, ...]) -> Replanned:
    stood = list(rest)
    for axis, start in zip(plan.axes, plan.start, strict=True):
        stood[axis] = start
    try:
        now = replan(models, plan, tuple(stood))
    except (Refusal, ValueError) as fault:
        reason = str(fault).splitlines()[0]
        return Replanned(move_id=plan.move_id, group=plan.group, same=False, error=None, reason=reason)
    before = path_of(plan)
    period = models.cell.period
    ticks = np.arange(0.0, max(now.duration, before.duration) + period, period)
    error = float(np.abs(now.sample(ticks)[0] - before.sample(ticks)[0]).max())
    return Replanned(move_id=plan.move_id, group=plan.group, same=error <= TOLERANCE, error=error)


def _rests(paths: Sequence[Path]) -> dict[int, tuple[float, ...]]:
    """Setpoints of all axes at the first tick of each plan."""
    found: dict[int, tuple[float, ...]] = {}
    for part in Run(paths).parts():
        if isinstance(part, Piece):
            ids = part.fresh("plan_id")
            for plan_id in dict.fromkeys(ids[ids != 0].tolist()):
                row = int((ids == plan_id).any(axis=1).argmax())
                found.setdefault(plan_id, tuple(part.fresh("position")[row].tolist()))
    return found
