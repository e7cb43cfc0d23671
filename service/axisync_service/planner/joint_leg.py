"""Joint moves: MASA over the group's axes; to a pose in the configuration that is soonest reached."""

import numpy as np
from numpy.typing import NDArray

from axisync_motion import InfeasibleDuration, InvalidLimits, SyncProfile, from_profiles, synchronise
from axisync_robot.inverse_errors import PathRefused
from axisync_robot.inverse_pose import solve_pose
from axisync_robot.poses import inverse_pose
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.moves import JointMove, SingleMove, ToolPose
from axisync_service.planner.leg import Leg
from axisync_service.planner.models import Models
from axisync_service.planner.refusals import refusal_of_path
from axisync_service.planner.targets import joint_target, placement_of, target_pose

Array = NDArray[np.float64]


def joint_leg(models: Models, group: str, move: JointMove, start: Array, speed_scale: float) -> Leg:
    """
    Raises:
        Refusal: INFEASIBLE_DURATION, SOFT_LIMIT, UNREACHABLE, INVALID_REQUEST (wrong number of values, a distance that
            no motion can be computed for).
    """
    axes = models.axes(group)
    if isinstance(move.target, ToolPose):
        target = _pose_target(models, group, move, move.target, start)
    else:
        target = joint_target(axes, move.target, move.relative, start)
    names = tuple(axis.name for axis in axes)
    limits = np.array([(axis.limits.velocity, axis.limits.acceleration, axis.limits.jerk) for axis in axes])
    profile = timed(names, target - start, limits, move, speed_scale)
    moving = profile.duration > 0.0
    return Leg(
        kind=move.kind,
        trajectory=from_profiles(start, profile, target) if moving else None,
        end=target,
        scalars=names,
        T=profile.T,
        U=profile.U,
        minimum=profile.minimum_durations,
        limiting=names[profile.limiting] if moving else None,
        contacts=move.contacts,
    )


def _pose_target(models: Models, group: str, move: JointMove, pose: ToolPose, start: Array) -> Array:
    members = models.members(group)
    if len(members) != 1:
        message = f"{group} has {len(members)} arms: a joint move to a pose is of one; take kind linear or joint values"
        raise Refusal(ErrorCode.INVALID_REQUEST, message, group=group)
    member = members[0]
    arm = member.kinematics()
    tool = arm.placement(start)
    frame = placement_of(move.frame, arm, tool)
    target = frame @ target_pose(pose, move.relative, inverse_pose(frame) @ tool)
    speeds = np.array([axis.limits.velocity for axis in member.group.axes])
    try:
        return solve_pose(member.inverse(start), target, start, speeds)
    except PathRefused as refused:
        raise refusal_of_path(refused, member, frame, None) from None


def timed(names: tuple[str, ...], distances: Array, limits: Array, move: SingleMove, speed_scale: float) -> SyncProfile:
    """MASA within limits[n, 3]; `speed_scale` s means V s, A s^2, J s^3: the same curve, 1/s as fast.

    Raises:
        Refusal: INFEASIBLE_DURATION, INVALID_REQUEST.
    """
    v, a, j = (limits * np.array([speed_scale, speed_scale**2, speed_scale**3])).T.tolist()
    try:
        return synchronise(
            distances.tolist(), v, a, j, minimise=move.minimise, duration=move.duration_s, pulse=move.pulse
        )
    except InfeasibleDuration as error:
        name = names[error.axis] if error.axis is not None else None
        message = f"{error.value:.6g} s is too short for {name}"
        raise Refusal(
            ErrorCode.INFEASIBLE_DURATION, message, axis=name, required=error.shortest, value=error.value,
            shortest_duration_s=error.shortest,
        ) from None  # fmt: skip
    except InvalidLimits as error:
        name = names[error.axis] if error.axis is not None else None
        message = f"{name}: {error.name} = {error.value:g} must be {error.bound}"
        fault = {"path": "move", "message": message, "value": error.value}
        raise Refusal(ErrorCode.INVALID_REQUEST, message, axis=name, errors=[fault]) from None
