"""Where a jog leads: straight on in joint space or with the tool, as far as limits, reach and singularities allow.

Time along a way passes as if the velocity asked for were in force from its start to its end.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_motion import from_profiles
from axisync_robot.inverse import follow_far
from axisync_robot.inverse_errors import PathRefused
from axisync_robot.inverse_path import Ended
from axisync_robot.poses import inverse_pose, pose_of, quaternion_of_rotation, rotation_of_vector
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import Jog
from axisync_schemas.moves import Frame, JointMove, LinearMove, ToolPose
from axisync_service.planner.cartesian_leg import cartesian_leg
from axisync_service.planner.joint_leg import timed
from axisync_service.planner.leg import Leg
from axisync_service.planner.models import Member, Models
from axisync_service.planner.targets import placement_of

Array = NDArray[np.float64]

HORIZON_S = 30.0
"""One plan goes no farther; a jog that lasts longer goes on with another."""
LENGTH_MAX, TURN_MAX = 1.0, 2.5
"""m and rad, of one plan: a turn of pi or more would have a shorter way back."""
STEP_JOINT, STEP_LENGTH, STEP_TURN = 0.05, 0.003, 0.01
"""Between samples, rad and m."""
FEWEST, MOST = 9, 400
BETWEEN = 1.005
"""By so much the tool may be faster between samples."""
LEAST = 1e-3
"""rad: where no joint could go farther, the jog is refused instead."""
CENTRIPETAL = 0.5
"""Of a joint's acceleration limit, for the way's bends at full speed; the rest is for speeding up and slowing down."""
SLOWED_MAX = 2.0
"""Into a singularity one plan goes on until it would be so many times slower than where it begins."""
JERK_SHARE = 0.5
JOINTS = "jog its joints"
TINY = 1e-12


@dataclass(frozen=True, slots=True)
class End:
    """What a way ends at; `fix` is what to do instead."""

    code: ErrorCode
    words: str
    details: dict[str, Any] = field(default_factory=dict)
    fix: str = "jog the other way"


@dataclass(frozen=True, slots=True, eq=False)
class Pace:
    """How fast a way is gone: a share of the velocity asked for, and how fast that share may change, 1/s and 1/s^2.

    `limited_by`: what it is, that the share is below 1.
    """

    share: float
    acceleration: float
    jerk: float
    limited_by: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Samples q [k, n] (rad) at times [k] (s); `end` is None where it ends only since one plan goes no farther.

    `leg_to` makes the leg that ends, at rest, at a time of the way, at a pace.
    """

    times: Array
    q: Array
    pace: Pace
    leg_to: Callable[[float, Pace], Leg]
    end: End | None = None

    @property
    def duration(self) -> float:
        """s."""
        return float(self.times[-1])

    @property
    def leads_nowhere(self) -> bool:
        """It is blocked where it begins."""
        return self.end is not None and bool(np.abs(self.q[-1] - self.q[0]).max() < LEAST)

    def until(self, time: float, end: End) -> "Way":
        """A part of it."""
        time = min(max(time, 0.0), self.duration)
        times = np.append(self.times[self.times < time], time) if time > 0.0 else np.zeros(1)
        q = np.stack([np.interp(times, self.times, column) for column in self.q.T], axis=-1)
        return replace(self, times=times, q=q, end=end)

    def leg(self) -> Leg:
        """The whole of it."""
        return self.leg_to(self.duration, self.pace)


# --- joint space ------------------------------------------------------------------------------------------------


def joint_way(models: Models, group: str, velocity: Array, start: Array) -> Way:
    """All axes at velocity [n] (rad/s) until the first is at its soft limit; from outside of one, only inwards."""
    axes = models.axes(group)
    moving = np.abs(velocity) > 0.0
    low, high = np.array([axis.soft_limits for axis in axes]).T
    bound = np.where(velocity > 0.0, high, low)
    left = np.full(len(axes), math.inf)
    np.divide(bound - start, velocity, out=left, where=moving)
    first = int(left.argmin())
    blocked = bool(left[first] <= HORIZON_S)
    duration = max(0.0, float(left[first])) if blocked else HORIZON_S
    name, value = axes[first].name, float(bound[first])
    words = f"{name} is at its soft limit {math.degrees(value):.6g} deg"
    end = End(ErrorCode.SOFT_LIMIT, words, {"axis": name, "bound": value}) if blocked else None
    count = int(np.clip(math.ceil(float(np.abs(velocity).max()) * duration / STEP_JOINT) + 1, FEWEST, MOST))
    times = np.linspace(0.0, duration, count)
    q = start + velocity * times[:, np.newaxis]
    pace = _joint_pace(models, group, velocity, q, times)

    def leg_to(time: float, pace: Pace) -> Leg:
        target = start + velocity * time
        if blocked and time == duration:
            target[first] = bound[first]
        return _joint_leg(models, group, velocity, start, target, pace)

    return Way(times, q, pace, leg_to, end)


def _joint_pace(models: Models, group: str, velocity: Array, q: Array, times: Array) -> Pace:
    axes = models.axes(group)
    moving = np.flatnonzero(velocity)
    speeds = np.abs(velocity[moving])
    v, a, j = np.array(
        [(axes[i].limits.velocity, axes[i].limits.acceleration, axes[i].limits.jerk) for i in moving.tolist()]
    ).T
    slowest = int((v / speeds).argmin())
    share, limited_by = float(v[slowest] / speeds[slowest]), f"the velocity limit of {axes[moving[slowest]].name}"
    for member in models.members(group):
        cap = member.group.jog.tool_speed_max
        if member.arm is None or times[-1] == 0.0:
            continue
        along = velocity[member.columns]
        fastest = max(float(np.linalg.norm(member.arm.jacobian(row)[1][:3] @ along)) for row in q[:, member.columns])
        if fastest * BETWEEN * share > cap:
            share, limited_by = cap / (fastest * BETWEEN), f"tool_speed_max of {member.group.name}"
    return Pace(
        min(1.0, share), float((a / speeds).min()), float((j / speeds).min()), limited_by if share < 1.0 else None
    )


def _joint_leg(models: Models, group: str, velocity: Array, start: Array, target: Array, pace: Pace) -> Leg:
    """A straight line in joint space: limits in proportion to the velocities."""
    axes = models.axes(group)
    names = tuple(axis.name for axis in axes)
    own = np.array([(axis.limits.velocity, axis.limits.acceleration, axis.limits.jerk) for axis in axes])
    along = np.abs(velocity)[:, np.newaxis] * np.array([pace.share, pace.acceleration, pace.jerk])
    limits = np.where(along > 0.0, np.minimum(along, own), own)
    profile = timed(names, target - start, limits, JointMove(target=tuple(target.tolist())), 1.0)
    moving = profile.duration > 0.0
    return Leg(
        kind="joint",
        trajectory=from_profiles(start, profile, target) if moving else None,
        end=target,
        scalars=names,
        T=profile.T,
        U=profile.U,
        minimum=profile.minimum_durations,
        limiting=names[profile.limiting] if moving else None,
    )


# --- the tool ---------------------------------------------------------------------------------------------------


def tool_way(models: Models, group: str, jog: Jog, start: Array) -> Way:
    """The tool along and about fixed axes of a frame, as they are when the motion begins.

    Raises:
        Refusal: INVALID_REQUEST (no arm, or several), SINGULAR_PATH (the arm stands at a singularity).
    """
    members = models.members(group)
    if len(members) != 1:
        names = " and ".join(member.group.name for member in members)
        message = f"{group}: the tools of {names} are jogged one at a time"
        fault = {"path": "group", "message": message, "value": group}
        raise Refusal(ErrorCode.INVALID_REQUEST, message, errors=[fault])
    (member,) = members
    assert jog.space != "joint"
    space: Frame = jog.space
    twist = np.zeros(6)
    twist[: len(jog.velocity)] = jog.velocity
    tool = member.kinematics().placement(start)
    frame = placement_of(space, member.kinematics(), tool)
    times = _times(twist)
    followed = _followed(member, frame, tool, twist, times, start)
    count = len(followed.angles)
    end = _end_of(member, followed.ended) if followed.ended is not None else None

    def leg_to(time: float, pace: Pace) -> Leg:
        return _tool_leg(models, group, space, twist, time, start, pace)

    way, share, by = _slowed(member, Way(times[:count], followed.angles, Pace(1.0, 1.0, 1.0), leg_to, end))
    return replace(way, pace=_tool_pace(member, twist, way, share, by))


def _times(twist: Array) -> Array:
    """[k] where the way is looked at."""
    speed, turning = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    duration = min(HORIZON_S, LENGTH_MAX / max(speed, TINY), TURN_MAX / max(turning, TINY))
    count = math.ceil(max(speed * duration / STEP_LENGTH, turning * duration / STEP_TURN)) + 1
    return np.linspace(0.0, duration, int(np.clip(count, FEWEST, MOST)))


def _followed(member: Member, frame: Array, tool: Array, twist: Array, times: Array, start: Array) -> Any:
    begin = inverse_pose(frame) @ tool
    turns = rotation_of_vector(twist[3:] * times[:, np.newaxis]) @ begin[:3, :3]
    poses = frame @ pose_of(begin[:3, 3] + twist[:3] * times[:, np.newaxis], turns)
    try:
        return follow_far(member.inverse(start), poses, start)
    except PathRefused as refused:
        message = f"{member.group.name} stands where its tool cannot be led: {refused}"
        raise Refusal(ErrorCode.SINGULAR_PATH, message, group=member.group.name, fix=JOINTS) from None


def _end_of(member: Member, ended: Ended) -> End:
    name = member.group.name
    if ended.joint is not None:
        axis = member.group.axes[ended.joint].name
        return End(ErrorCode.SOFT_LIMIT, f"{axis} would pass its soft limit", {"axis": axis})
    if ended.singular:
        return End(ErrorCode.SINGULAR_PATH, f"{name} is at a singularity", {"group": name}, JOINTS)
    return End(ErrorCode.UNREACHABLE, f"the tool of {name} is at the end of its reach", {"group": name})


def _slowed(member: Member, way: Way) -> tuple[Way, float, str | None]:
    """The part of it on which the joints can keep up, by what share of the velocity, and which of them sets that.

    Where they can do so at full speed at first, it ends where they no longer can. Where they cannot, near a
    singularity, it ends where they could only at half of that speed, or could at twice: the next plan is of another.
    """
    if len(way.times) < FEWEST:
        return way, 1.0, None
    first, second = _slopes(way)
    limits = np.array([(axis.limits.velocity, axis.limits.acceleration) for axis in member.group.axes])
    demands = np.maximum(np.abs(first) / limits[:, 0], np.sqrt(np.abs(second) / (CENTRIPETAL * limits[:, 1])))
    factors = demands.max(axis=1)
    here = float(factors[:3].max())
    slow = here > 1.0
    out = factors > (SLOWED_MAX * here if slow else 1.0)
    if slow:
        out |= (factors < here / SLOWED_MAX) & (factors > 0.5)
    if out[3:].any():
        at = 3 + int(out[3:].argmax())
        name = member.group.name
        if factors[at] > 1.0:
            end = End(ErrorCode.SINGULAR_PATH, f"{name} comes near a singularity", {"group": name}, JOINTS)
        else:
            end = End(ErrorCode.SINGULAR_PATH, f"{name} leaves a singularity", {"group": name}, JOINTS)
        way = way.until(float(way.times[at - 1]), end)
        factors, demands = factors[:at], demands[:at]
    most = float(factors.max())
    joint = int(demands.max(axis=0).argmax())
    limited_by = f"the limits of {member.group.axes[joint].name}, near a singularity" if most > 1.0 else None
    return way, 1.0 / max(1.0, most), limited_by


def _slopes(way: Way) -> tuple[Array, Array]:
    """[k, n] first and second derivative of q by the way's time."""
    first = np.gradient(way.q, way.times, axis=0, edge_order=2)
    return first, np.gradient(first, way.times, axis=0, edge_order=2)


def _tool_pace(member: Member, twist: Array, way: Way, share: float, limited_by: str | None) -> Pace:
    """Within what the tool and the joints may do, all along the way."""
    path = member.group.path
    speed, turning = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    caps = (
        (speed, member.group.jog.tool_speed_max, f"tool_speed_max of {member.group.name}"),
        (turning, path.angular_limits.velocity, f"angular_limits of {member.group.name}"),
    )
    for value, cap, name in caps:
        if value * share > cap:
            share, limited_by = cap / value, name
    linear, angular = path.linear_limits, path.angular_limits
    acceleration = min(linear.acceleration / max(speed, TINY), angular.acceleration / max(turning, TINY))
    jerk = min(linear.jerk / max(speed, TINY), angular.jerk / max(turning, TINY))
    if len(way.times) >= FEWEST:
        first, second = _slopes(way)
        a, j = np.array([(axis.limits.acceleration, axis.limits.jerk) for axis in member.group.axes]).T
        slopes = np.maximum(np.abs(first), TINY)
        acceleration = min(acceleration, float(((a - np.abs(second) * share**2) / slopes).min()))
        jerk = min(jerk, float((JERK_SHARE * j / slopes).min()))
    return Pace(share, acceleration, jerk, limited_by)


def _tool_leg(
    models: Models, group: str, space: Frame, twist: Array, time: float, start: Array, pace: Pace
) -> Leg:  # fmt: skip
    """The line to where the tool is at a time of the way."""
    turned = rotation_of_vector(twist[3:] * time)
    x, y, z = (twist[:3] * time).tolist()
    qx, qy, qz, qw = quaternion_of_rotation(turned).tolist()
    limits = np.array([pace.share, pace.acceleration, pace.jerk])
    lengths, angles = (
        tuple((float(np.linalg.norm(part)) * limits).tolist()) if part.any() else None
        for part in (twist[:3], twist[3:])
    )
    pose = ToolPose(position=(x, y, z), quaternion=(qx, qy, qz, qw) if twist[3:].any() else None)
    move = LinearMove(target=pose, relative=True, frame=space, linear_limits=lengths, angular_limits=angles)
    return cartesian_leg(models, group, move, start, 1.0)
