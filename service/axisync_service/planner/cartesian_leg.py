"""Moves of the tool: path, MASA over its length and angles, joints along it, and their limits (section V.B.2)."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisync_motion import SyncProfile, from_profiles
from axisync_motion.fitting import NotSmooth, fit, stretched
from axisync_motion.path_bounds import cell_bounds
from axisync_motion.trajectory import Trajectory
from axisync_robot import paths
from axisync_robot.inverse import Inverse, follow
from axisync_robot.inverse_errors import PathRefused, Unreachable
from axisync_robot.inverse_path import nearest_singularity
from axisync_robot.inverse_pose import solve_pose
from axisync_robot.paths import PathError, ToolPath
from axisync_robot.poses import inverse_pose, vector_of_rotation
from axisync_robot.ur_inverse import UrInverse
from axisync_schemas.cell import Axis
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.moves import Circle, CircularMove, LinearMove, PathMove, ToolPose
from axisync_service.planner.joint_leg import timed
from axisync_service.planner.leg import Leg
from axisync_service.planner.models import Member, Models
from axisync_service.planner.refusals import refusal_of_path
from axisync_service.planner.targets import placement_of, rotation_of, target_pose

Array = NDArray[np.float64]
Cartesian = LinearMove | CircularMove | PathMove
Quantity = Literal["velocity", "acceleration", "jerk"]

POSITION_TOLERANCE = 1e-9
"""rad: a thousandth of what the design asks for."""
JERK_TOLERANCE = 1e-3
"""Of the joint's limit."""
FOLLOWED = 256
"""Samples along a path up to where it is not smooth: joints there follow from those before."""
JUMP_MAX = 0.01
"""Of an axis's acceleration limit: more, from one piece to the next, is no rounding."""
CELL_S = 0.01
"""Width of the cells over which the joints' velocities, accelerations and jerks are bounded."""
CELLS_MAX = 4096
"""However long the move is; wider cells bound less tightly."""
CONFIRMATIONS, SLOWER = 5, 1e-5
"""How often a feasible speed is tried before it is told, and by what share it is lowered each time."""
SLACK = 1e-9
"""By which a stretched move stays below the limits: for rounding."""
TWIST_SHARE, TWIST_LEAST = 1e-4, 1e-6
"""Of a scalar, and m or rad: over how much of it the tool's motion by it is taken; less is rounding."""
QUANTITIES: tuple[Quantity, ...] = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, slots=True, eq=False)
class _Route:
    """One arm's path within a move: `frame` [4, 4] is the request's, in O; `rows` are its scalars among the move's."""

    member: Member
    frame: Array
    path: ToolPath
    inverse: Inverse
    start: Array
    rows: slice

    def joints(self, values: Array, times: Array) -> Array:
        """[k, n] along scalars [k, m].

        Raises:
            Refusal: the arm cannot follow.
        """
        try:
            return follow(self.inverse, self.frame @ self.path.poses(values[:, self.rows]), self.start).angles
        except PathRefused as refused:
            self._check_target()
            raise refusal_of_path(refused, self.member, self.frame, float(times[refused.sample])) from None

    def slope(self, scalars: Array, angles: Array) -> Array:
        """[n, m] rad/m and rad/rad: how the joints [n] move with each of the scalars [m]."""
        _, jacobian = self.member.kinematics().jacobian(angles)
        twists = np.stack([self._twist(scalars, index) for index in range(scalars.size)], axis=-1)
        return np.linalg.lstsq(jacobian, twists, rcond=None)[0].astype(np.float64, copy=False)

    def singularity(self, angles: Array) -> str:
        """The one that these joints [n] are nearest to; an arm without a closed form has no names for them."""
        return nearest_singularity(self.inverse, angles) if isinstance(self.inverse, UrInverse) else "arm"

    def _twist(self, scalars: Array, index: int) -> Array:
        """[6] how the tool moves and turns, in O, with one scalar: from the poses on either side, along the path."""
        whole = float(self.path.distances[index])
        if whole == 0.0:
            return np.zeros(6)
        step = max(TWIST_SHARE * abs(whole), min(0.5 * abs(whole), TWIST_LEAST))
        values = np.repeat(scalars[np.newaxis], 2, axis=0)
        values[:, index] = np.clip(scalars[index] + np.array([-step, step]), min(0.0, whole), max(0.0, whole))
        low, high = self.frame @ self.path.poses(values)
        turned = vector_of_rotation(high[:3, :3] @ low[:3, :3].T)
        twist: Array = np.concatenate([high[:3, 3] - low[:3, 3], turned]) / (values[1, index] - values[0, index])
        return twist

    def _check_target(self) -> None:
        """Where the target itself is out of reach, that is what helps."""
        try:
            solve_pose(self.inverse, self.frame @ self.path.end, self.start, np.ones_like(self.start))
        except Unreachable as refused:
            raise refusal_of_path(refused, self.member, self.frame, None) from None
        except PathRefused:
            return


def cartesian_leg(models: Models, group: str, move: Cartesian, start: Array, speed_scale: float) -> Leg:
    """A duration that was asked for is kept: where the joints' limits would stretch that motion, the shortest one is
    slowed down to it instead.

    Raises:
        Refusal: UNREACHABLE, SINGULAR_PATH, SOFT_LIMIT, JOINT_LIMIT (only without retime), INFEASIBLE_DURATION,
            INVALID_REQUEST.
    """
    if not move.retime:
        return _unstretched(models, group, move, start, speed_scale)
    if move.duration_s is None:
        return _leg(models, group, move, start, speed_scale)
    shortest = _leg(models, group, move.model_copy(update={"duration_s": None}), start, speed_scale)
    if move.duration_s < shortest.duration:
        message = f"{move.duration_s:.6g} s is too short for {shortest.limiting}"
        raise Refusal(
            ErrorCode.INFEASIBLE_DURATION, message, axis=shortest.limiting, required=shortest.duration,
            value=move.duration_s, shortest_duration_s=shortest.duration,
        )  # fmt: skip
    leg = _leg(models, group, move, start, speed_scale)
    return leg if leg.scale == 1.0 else _slower(shortest, move.duration_s / shortest.duration)


def _unstretched(models: Models, group: str, move: Cartesian, start: Array, speed_scale: float) -> Leg:
    try:
        return _leg(models, group, move, start, speed_scale)
    except Refusal as refusal:
        if "max_feasible_speed_scale" in refusal.details:
            speed = refusal.details["max_feasible_speed_scale"]
            refusal.details["max_feasible_speed_scale"] = _confirmed(models, group, move, start, speed)
        raise


def _confirmed(models: Models, group: str, move: Cartesian, start: Array, speed_scale: float) -> float:
    """A speed, or the little less that is possible: bounds at another speed differ by what they are above the peaks."""
    for _ in range(CONFIRMATIONS):
        try:
            _leg(models, group, move, start, speed_scale)
        except Refusal as refusal:
            speed_scale = (1.0 - SLOWER) * refusal.details.get("max_feasible_speed_scale", speed_scale)
        else:
            break
    return speed_scale


def _slower(leg: Leg, factor: float) -> Leg:
    trajectory = None if leg.trajectory is None else stretched(leg.trajectory, factor)
    return replace(leg, trajectory=trajectory, T=leg.T * factor, U=leg.U / factor**3, scale=leg.scale * factor)


def _leg(models: Models, group: str, move: Cartesian, start: Array, speed_scale: float) -> Leg:
    routes = _routes(models.members(group), move, start)
    names, distances, limits = _scalars(routes, move)
    profile = timed(names, distances, limits, move, speed_scale)
    if profile.duration == 0.0:
        return Leg(move.kind, None, start.copy(), names, profile.T, profile.U, profile.minimum_durations)
    axes = models.axes(group)
    trajectory = _fitted(routes, axes, profile, start)
    demand = _demand(trajectory, axes)
    scale = _scale(demand, axes, routes, move, speed_scale, trajectory)
    _check_jumps(trajectory, axes, routes, scale)
    leg = Leg(
        kind=move.kind,
        trajectory=trajectory,
        end=trajectory.end,
        scalars=names,
        T=profile.T,
        U=profile.U,
        minimum=profile.minimum_durations,
        limiting=axes[demand.axis].name if scale > 1.0 else names[profile.limiting],
        contacts=move.contacts,
    )
    return _slower(leg, scale) if scale > 1.0 else leg


def _routes(members: tuple[Member, ...], move: Cartesian, start: Array) -> list[_Route]:
    routes: list[_Route] = []
    for member, pose in _moved(members, move):
        arm, joints = member.kinematics(), start[member.columns]
        tool = arm.placement(joints)
        frame = placement_of(move.frame, arm, tool)
        try:
            path = _path(move, pose, inverse_pose(frame) @ tool)
        except PathError as error:
            raise _invalid(f"{member.group.name}: {error}") from None
        begin = routes[-1].rows.stop if routes else 0
        rows = slice(begin, begin + len(path.names))
        routes.append(_Route(member, frame, path, member.inverse(joints), joints, rows))
    return routes


def _invalid(message: str) -> Refusal:
    return Refusal(ErrorCode.INVALID_REQUEST, message, errors=[{"path": "move", "message": message}])


def _moved(members: tuple[Member, ...], move: Cartesian) -> list[tuple[Member, ToolPose]]:
    """The members that move, each with its target; for a path it only says which orientation it ends with."""
    names = tuple(member.group.name for member in members)
    if isinstance(move, LinearMove):
        try:
            targets = move.targets(names)
        except ValueError as error:
            raise _invalid(f"move.target: {error}") from None
        return [(member, targets[member.group.name]) for member in members if member.group.name in targets]
    if len(members) != 1:
        raise _invalid(f"a {move.kind} move is of one arm, not of {' and '.join(names)}; take kind linear for several")
    return [(members[0], move.target if isinstance(move, CircularMove) else ToolPose(position=(0.0, 0.0, 0.0)))]


def _path(move: Cartesian, pose: ToolPose, start: Array) -> ToolPath:
    """In the frame that `start` [4, 4] is in.

    Raises:
        PathError: there is no such path.
    """
    if isinstance(move, LinearMove):
        return paths.line(start, target_pose(pose, move.relative, start), move.orientation)
    if isinstance(move, CircularMove):
        return paths.arc(start, np.array(move.via.position), target_pose(pose, False, start), move.orientation)
    end = rotation_of(move.end, start[:3, :3])
    curve = move.curve
    if isinstance(curve, Circle):
        return paths.circle(start, curve.centre, curve.normal, curve.angle, curve.pitch, end, move.orientation)
    return paths.lissajous(start, curve.amplitude, curve.frequency, curve.phase, end, move.orientation)


def _scalars(routes: list[_Route], move: Cartesian) -> tuple[tuple[str, ...], Array, Array]:
    """Names, distances [m] and limits [m, 3] of what MASA synchronises; several arms' names are told apart."""
    names: list[str] = []
    limits: list[tuple[float, float, float]] = []
    for route in routes:
        prefix = f"{route.member.group.name}." if len(routes) > 1 else ""
        names += [prefix + name for name in route.path.names]
        settings = route.member.group.path
        own, turn = settings.linear_limits, settings.angular_limits
        linear = move.linear_limits or (own.velocity, own.acceleration, own.jerk)
        angular = move.angular_limits or (turn.velocity, turn.acceleration, turn.jerk)
        limits += [angular if is_angle else linear for is_angle in route.path.angular.tolist()]
    return tuple(names), np.concatenate([route.path.distances for route in routes]), np.array(limits)


def _check_jumps(trajectory: Trajectory, axes: tuple[Axis, ...], routes: list[_Route], scale: float) -> None:
    """Where a path begins or ends at a singularity (a stretched elbow), joints set off with acceleration.

    Raises:
        Refusal: SINGULAR_PATH.
    """
    knots, rest = trajectory.knots, np.zeros((1, len(axes)))
    after = np.vstack([trajectory.sample(knots[:-1])[2], rest])
    before = np.vstack([rest, trajectory.sample(np.nextafter(knots[1:], 0.0))[2]])
    jumps = np.abs(after - before) / scale**2 / np.array([axis.limits.acceleration for axis in axes])
    knot, axis = (int(i) for i in np.unravel_index(int(jumps.argmax()), jumps.shape))
    if jumps[knot, axis] > JUMP_MAX:
        where = _singularity(routes, axis, trajectory, float(knots[knot]))
        raise _jump(axes[axis].name, scale * float(knots[knot]), where)


def _route_of(axis: int, routes: list[_Route]) -> _Route:
    return next(route for route in routes if axis in range(route.member.columns.stop)[route.member.columns])


def _singularity(routes: list[_Route], axis: int, trajectory: Trajectory, time: float) -> str:
    """The nearest one of the arm that the axis belongs to."""
    route = _route_of(axis, routes)
    return route.singularity(trajectory.sample(np.array([time]))[0][0][route.member.columns])


def _jump(name: str, time: float, singularity: str) -> Refusal:
    message = f"{name} would have to jump at {time:.3f} s of the move: the path passes a singularity ({singularity})"
    return Refusal(ErrorCode.SINGULAR_PATH, message, axis=name, time_s=time, singularity=singularity)


def _fitted(routes: list[_Route], axes: tuple[Axis, ...], profile: SyncProfile, start: Array) -> Trajectory:
    """The joints' motion as polynomials between MASA's segment boundaries."""

    def joints(times: Array) -> Array:
        values = profile.sample(times)[0]
        q = np.repeat(start[np.newaxis], len(times), axis=0)
        for route in routes:
            q[:, route.member.columns] = route.joints(values, times)
        return q

    def slope(time: float, position: Array) -> Array:
        scalars = profile.sample(np.array([time]))[0][0]
        by = np.zeros((len(axes), len(scalars)))
        for route in routes:
            by[route.member.columns, route.rows] = route.slope(scalars[route.rows], position[route.member.columns])
        return by

    motion = from_profiles(np.zeros_like(profile.distances), profile)
    tolerance = JERK_TOLERANCE * np.array([axis.limits.jerk for axis in axes])
    try:
        return fit(joints, motion, slope, np.full(len(axes), POSITION_TOLERANCE), tolerance, start)
    except NotSmooth as error:
        route = _route_of(error.axis, routes)
        at = joints(np.linspace(0.0, error.time, FOLLOWED))[-1][route.member.columns]
        raise _jump(axes[error.axis].name, error.time, route.singularity(at)) from None


@dataclass(frozen=True, slots=True)
class _Demand:
    """What asks most of its limit: by `factor` the move must be slower (below 1: it could be faster)."""

    factor: float
    axis: int
    quantity: Quantity
    time: float
    required: float
    allowed: float


def _demand(trajectory: Trajectory, axes: tuple[Axis, ...]) -> _Demand:
    """k of a path: the largest of v/V, sqrt(a/A), cbrt(j/J), of rigorous bounds."""
    cells = int(np.clip(math.ceil(trajectory.duration / CELL_S), 16, CELLS_MAX))
    bounds = cell_bounds(trajectory, cells)[:-1]
    peaks = np.maximum(bounds[..., : len(axes)], bounds[..., len(axes) :])
    limits = np.array([(axis.limits.velocity, axis.limits.acceleration, axis.limits.jerk) for axis in axes]).T
    factors = (peaks / limits) ** (1.0 / np.arange(1, 4))[:, np.newaxis]
    cell, power, axis = (int(i) for i in np.unravel_index(int(factors.argmax()), factors.shape))
    return _Demand(
        factor=float(factors[cell, power, axis]),
        axis=axis,
        quantity=QUANTITIES[power],
        time=(cell + 0.5) * trajectory.duration / cells,
        required=float(peaks[cell, power, axis]),
        allowed=float(limits[power, axis]),
    )


def _scale(
    demand: _Demand, axes: tuple[Axis, ...], routes: list[_Route], move: Cartesian, speed_scale: float,
    trajectory: Trajectory,
) -> float:  # fmt: skip
    """By how much the move is stretched.

    Raises:
        Refusal: SINGULAR_PATH where that is more than the cell file has, JOINT_LIMIT where it may not be at all.
    """
    if demand.factor <= 1.0:
        return 1.0
    name, scale = axes[demand.axis].name, demand.factor * (1.0 + SLACK)
    bound = min(route.member.group.path.scale_max for route in routes)
    details = {"axis": name, "quantity": demand.quantity, "time_s": demand.time, "required": demand.required,
               "allowed": demand.allowed}  # fmt: skip
    if scale > bound:
        where = _singularity(routes, demand.axis, trajectory, demand.time)
        message = (
            f"at {demand.time:.3f} s {name} would need {scale:.3g} times less speed (scale_max of the cell file is "
            f"{bound:g}): the path passes too near a singularity ({where}), or its limits are far beyond this arm's"
        )
        raise Refusal(ErrorCode.SINGULAR_PATH, message, **details, scale=scale, scale_max=bound, singularity=where)
    if not move.retime:
        message = (
            f"{name}: {demand.quantity} at {demand.time:.3f} s would be {100 * demand.required / demand.allowed:.3g} % "
            f"of its limit"
        )
        raise Refusal(ErrorCode.JOINT_LIMIT, message, **details, max_feasible_speed_scale=speed_scale / scale)
    return scale
