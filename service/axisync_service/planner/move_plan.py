"""Plans a whole move: its legs, the checks that need the path, what stops need, and the reply."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_motion.rate_tables import rate_tables
from axisync_motion.trajectory import Trajectory, concatenate, dwell
from axisync_schemas.cell import Axis
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import Jog, PlanJob
from axisync_schemas.moves import Dwell, JointMove, SequenceMove, Step
from axisync_schemas.plan_slots import Plan
from axisync_schemas.replies import AloneReport, JogAhead, MoveReply, StepReport
from axisync_service.planner.box import Room, room
from axisync_service.planner.cartesian_leg import cartesian_leg
from axisync_service.planner.clearance import Clearance, Guard
from axisync_service.planner.joint_leg import joint_leg
from axisync_service.planner.leg import Leg
from axisync_service.planner.models import Models

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Planned:
    """What a job came to; `plan` is None where nothing moves, or nothing is to be played."""

    reply: MoveReply
    plan: Plan | None
    jog: JogAhead | None = None


@dataclass(frozen=True, slots=True)
class Checked:
    """What the checks of some legs found."""

    clearance: Clearance
    room: Room | None

    def worst(self, other: "Checked") -> "Checked":
        rooms = [found for found in (self.room, other.room) if found is not None]
        least = min(rooms, key=lambda found: found.margin, default=None)
        return Checked(self.clearance.worst(other.clearance), least)


def plan_move(models: Models, job: PlanJob, others: tuple[Plan, ...] = ()) -> Planned:
    """Plans `job` beside the plans of other groups.

    Raises:
        Refusal: see `joint_leg`, `cartesian_leg`; JOINT_LIMIT (a drive left alone could leave its hard limits),
            COLLISION. Of a sequence it names the step (`step`, from 0), and times count from the step's begin.
    """
    if isinstance(job.move, Jog):
        raise TypeError("a jog is planned by plan_jog")
    guard = Guard(models.cell, models.collision, job.group, np.array(job.rest))
    steps: Sequence[Step] = job.move.steps if isinstance(job.move, SequenceMove) else (job.move,)
    start = np.array(job.start)
    legs: list[Leg] = []
    checked = Checked(Clearance(), None)
    for index, step in enumerate(steps):
        try:
            leg = _leg(models, job.group, step, start, job.speed_scale)
            checked = checked.worst(check_leg(models, job.group, guard, leg, others))
        except Refusal as refusal:
            raise _in_step(refusal, index, steps, job.move) from None
        legs.append(leg)
        start = leg.end
    return planned(models, job, legs, checked)


def planned(models: Models, job: PlanJob, legs: list[Leg], checked: Checked, jog: JogAhead | None = None) -> Planned:
    """Legs that may be played, one after the other: with what the path clock needs, and the reply."""
    moving = [leg.trajectory for leg in legs if leg.trajectory is not None]
    trajectory = concatenate(moving) if moving else None
    plan = _playable(models, job, trajectory) if trajectory is not None and job.slot is not None else None
    return Planned(_reply(job, legs, checked, trajectory), plan, jog)


def _leg(models: Models, group: str, step: Step, start: Array, speed_scale: float) -> Leg:
    if isinstance(step, JointMove):
        return joint_leg(models, group, step, start, speed_scale)
    if isinstance(step, Dwell):
        return Leg(step.kind, dwell(start, step.duration_s), start)
    return cartesian_leg(models, group, step, start, speed_scale)


def check_leg(models: Models, group: str, guard: Guard, leg: Leg, others: tuple[Plan, ...]) -> Checked:
    """
    Raises:
        Refusal: JOINT_LIMIT, COLLISION.
    """
    if leg.trajectory is None:
        return Checked(Clearance(), None)
    found = room(leg.trajectory, models.cell, models.cell.axis_indices(group))
    if found.margin < 0.0:
        raise Refusal(
            ErrorCode.JOINT_LIMIT, found.message, axis=found.axis, time_s=found.time_s, required=found.required,
            allowed=found.allowed,
        )  # fmt: skip
    return Checked(guard.check(leg.trajectory, leg.contacts, others), found)


def _in_step(refusal: Refusal, index: int, steps: Sequence[Step], move: object) -> Refusal:
    """The same refusal, saying which step of a sequence it is about."""
    if not isinstance(move, SequenceMove):
        return refusal
    said = refusal.message.replace(" of the move", " of the step")
    message = f"step {index + 1} of {len(steps)} ({steps[index].kind}): {said}"
    return Refusal(refusal.code, message, **{**refusal.details, "step": index})


def _playable(models: Models, job: PlanJob, trajectory: Trajectory) -> Plan:
    """With what the path clock needs to change its rate anywhere on the path."""
    axes: tuple[Axis, ...] = models.axes(job.group)
    tables = rate_tables(
        trajectory,
        [axis.limits.velocity for axis in axes],
        [axis.limits.acceleration for axis in axes],
        [axis.limits.jerk for axis in axes],
        [axis.stop_limits.acceleration for axis in axes],
        [axis.stop_limits.jerk for axis in axes],
    )
    return Plan(
        plan_id=job.plan_id,
        axes=np.array(models.cell.axis_indices(job.group), dtype=np.uint32),
        knots=trajectory.knots,
        coefficients=trajectory.coefficients,
        start=trajectory.start,
        end=trajectory.end,
        rate_codes=tables.codes,
        rate_limits=tables.limits,
    )


def _reply(job: PlanJob, legs: list[Leg], checked: Checked, trajectory: Trajectory | None) -> MoveReply:
    """Without what front knows better: request_id, time, move_id."""
    only = legs[0]
    single = not isinstance(job.move, SequenceMove)
    near, alone = checked.clearance, None
    if checked.room is not None:
        alone = AloneReport(
            limit_margin=checked.room.margin, axis=checked.room.axis, min_distance_m=_finite(near.alone)
        )
    return MoveReply(
        request_id="",
        now_s=0.0,
        move_id=None,
        group=job.group,
        duration_s=trajectory.duration if trajectory is not None else 0.0,
        scalars=only.scalars if single else (),
        T=tuple(map(tuple, only.T.tolist())) if single else (),
        U=tuple(map(tuple, only.U.tolist())) if single else (),
        minimum_s=tuple(only.minimum.tolist()) if single else (),
        limiting=only.limiting if single else None,
        scale=max(leg.scale for leg in legs),
        min_distance_m=_finite(near.path),
        nearest=near.pair,
        alone=alone,
        steps=() if single else _steps(legs),
        end=tuple(legs[-1].end.tolist()),
    )


def _finite(distance: float) -> float | None:
    return distance if math.isfinite(distance) else None


def _steps(legs: list[Leg]) -> tuple[StepReport, ...]:
    begins = np.cumsum([0.0, *(leg.duration for leg in legs)]).tolist()
    return tuple(
        StepReport(kind=leg.kind, begins_s=begin, duration_s=leg.duration, limiting=leg.limiting, scale=leg.scale)
        for leg, begin in zip(legs, begins, strict=False)
    )
