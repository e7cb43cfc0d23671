"""Plans a joint move: MASA over the group's axes, the trajectory, its stop table, and the checks that need them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_motion import InfeasibleDuration, InvalidLimits, SyncProfile, from_profiles, synchronise
from axisync_motion.stop_table import stop_table
from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Axis, Cell
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import PlanJob
from axisync_schemas.plan_slots import Plan
from axisync_schemas.replies import MoveReply
from axisync_service.planner.box import breach
from axisync_service.planner.targets import target_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Planned:
    """What a job came to; `plan` is None where nothing moves, or nothing is to be played."""

    reply: MoveReply
    plan: Plan | None


def plan_joint_move(cell: Cell, job: PlanJob) -> Planned:
    """Plans `job`.

    Raises:
        Refusal: INFEASIBLE_DURATION, JOINT_LIMIT (a drive left alone could leave its hard limits), INVALID_REQUEST
            (a distance that no motion can be computed for).
    """
    indices = cell.axis_indices(job.group)
    axes = tuple(cell.axes[i] for i in indices)
    start, target = np.array(job.start), np.array(target_of(job.move, job.start))
    profile = _synchronise(axes, job, start, target)
    if profile.duration == 0.0:
        return Planned(_reply(axes, job, profile), None)
    trajectory = from_profiles(start, profile, target)
    _check_box(cell, axes, trajectory)
    plan = _playable(job.plan_id, indices, axes, trajectory) if job.slot is not None else None
    return Planned(_reply(axes, job, profile), plan)


def _playable(plan_id: int, indices: tuple[int, ...], axes: tuple[Axis, ...], trajectory: Trajectory) -> Plan:
    """With what a stop anywhere on the path needs, by far the dearest part of planning."""
    stops = stop_table(
        trajectory,
        [axis.limits.velocity for axis in axes],
        [axis.stop_limits.acceleration for axis in axes],
        [axis.stop_limits.jerk for axis in axes],
    )
    return Plan(
        plan_id=plan_id,
        axes=np.array(indices, dtype=np.uint32),
        knots=trajectory.knots,
        coefficients=trajectory.coefficients,
        start=trajectory.start,
        end=trajectory.end,
        stop_s=stops.s,
        stop_duration=stops.stop_duration,
    )


def _synchronise(axes: tuple[Axis, ...], job: PlanJob, start: Array, target: Array) -> SyncProfile:
    """MASA within the cell's limits; `speed_scale` s means V s, A s^2, J s^3: the same curve, 1/s as fast."""
    scale = job.speed_scale
    try:
        return synchronise(
            target - start,
            [axis.limits.velocity * scale for axis in axes],
            [axis.limits.acceleration * scale**2 for axis in axes],
            [axis.limits.jerk * scale**3 for axis in axes],
            minimise=job.move.minimise,
            duration=job.move.duration_s,
            pulse=job.move.pulse,
        )
    except InfeasibleDuration as error:
        name = axes[error.axis].name if error.axis is not None else None
        message = f"{error.value:.6g} s is too short for {name}"
        raise Refusal(
            ErrorCode.INFEASIBLE_DURATION, message, axis=name, required=error.shortest, value=error.value,
            shortest_duration_s=error.shortest,
        ) from None  # fmt: skip
    except InvalidLimits as error:
        name = axes[error.axis].name if error.axis is not None else None
        message = f"{name}: {error.name} = {error.value:g} must be {error.bound}"
        fault = {"path": "move", "message": message, "value": error.value}
        raise Refusal(ErrorCode.INVALID_REQUEST, message, axis=name, errors=[fault]) from None


def _check_box(cell: Cell, axes: tuple[Axis, ...], trajectory: Trajectory) -> None:
    found = breach(trajectory, axes, cell.period, cell.missed_ticks_max)
    if found is not None:
        raise Refusal(
            ErrorCode.JOINT_LIMIT, found.message, axis=found.axis, time_s=found.time_s, required=found.required,
            allowed=found.allowed,
        )  # fmt: skip


def _reply(axes: tuple[Axis, ...], job: PlanJob, profile: SyncProfile) -> MoveReply:
    """Without what front knows better: request_id, time, move_id."""
    moving = profile.duration > 0.0
    return MoveReply(
        request_id="",
        now_s=0.0,
        move_id=None,
        group=job.group,
        duration_s=profile.duration,
        scalars=tuple(axis.name for axis in axes),
        T=tuple(map(tuple, profile.T.tolist())),
        U=tuple(map(tuple, profile.U.tolist())),
        minimum_s=tuple(profile.minimum_durations.tolist()),
        limiting=axes[profile.limiting].name if moving else None,
    )
