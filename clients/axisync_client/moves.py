"""Moves as programs describe them, for `Client.plan`, `Lease.move` and as steps of a sequence.

    moves.linear(mm(300, 0, 200), euler_zyz=deg(0, 90, 0), frame="body")
    moves.linear({"kingkong": moves.pose(mm(0, 0, 50)), "wukong": moves.pose(mm(0, 0, 50))}, relative=True)
    moves.sequence([moves.joint(deg(0, -150, 60, -45, -45, 45)), moves.dwell(0.5), ...])

Arrays or plain sequences of numbers, rad and m. Every option is that of the model in `axisync_schemas.moves` by the
same name. What no daemon would take is an `InvalidArgument` with its path.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, TypeVar, Unpack

from pydantic import ValidationError

from axisync_client.errors import InvalidArgument, explain
from axisync_client.units import Floats, as_floats
from axisync_schemas.base import Strict
from axisync_schemas.moves import (
    CircularMove,
    Curve,
    Dwell,
    Frame,
    JointMove,
    LinearMove,
    Orientation,
    PathMove,
    SequenceMove,
    SingleMove,
    ToolPose,
)

M = TypeVar("M", bound=Strict)

Minimise = Literal["acceleration", "velocity", "jerk"]
Pulse = Literal["constant", "parabolic"]
Place = Floats | ToolPose
"""Where the tool is to be: x, y, z in m, or with an orientation."""
AnyMove = SingleMove | SequenceMove


class Timing(TypedDict, total=False):
    """How MASA times a move.

    `minimise`: which limit is lowered on what has time to spare. `duration_s`: longer than the shortest possible.
    `pulse`: "parabolic" has continuous jerk. `contacts`: pairs that may touch during the move.
    """

    minimise: Minimise
    duration_s: float | None
    pulse: Pulse
    contacts: Sequence[tuple[str, str]]


class JointOptions(Timing, total=False):
    """Of `joint`. `relative`: to the setpoint in force. `frame`: what a pose is given in."""

    relative: bool
    frame: Frame


class PathOptions(Timing, total=False):
    """Of every path of the tool.

    `quaternion` (x, y, z, w) or `euler_zyz` (rad): orientation at the end; without, it keeps the one it has.
    `linear_limits`, `angular_limits`: velocity, acceleration, jerk in m and rad. `retime`: stretch the move until every
    joint keeps its limits, instead of refusing it.
    """

    quaternion: Floats | None
    euler_zyz: Floats | None
    frame: Frame
    linear_limits: Floats | None
    angular_limits: Floats | None
    orientation: Literal["rotation_vector", "euler_zyz"]
    retime: bool


class LinearOptions(PathOptions, total=False):
    """Of `linear`. `relative`: the target is an offset along and about the axes of `frame`."""

    relative: bool


def pose(position: Floats, quaternion: Floats | None = None, euler_zyz: Floats | None = None) -> ToolPose:
    """Position (m) and an orientation: a quaternion x, y, z, w or intrinsic ZYZ angles (rad), or the present one."""
    return build(
        ToolPose,
        position=as_floats(position, "position"),
        quaternion=_optional(quaternion, "quaternion"),
        euler_zyz=_optional(euler_zyz, "euler_zyz"),
    )


def joint(target: Place, **options: Unpack[JointOptions]) -> JointMove:
    """All axes arrive at one time.

    `target` is one value for each axis, or a `pose`, which is reached in the configuration nearest the present one.
    """
    goal = target if isinstance(target, ToolPose) else as_floats(target, "target")
    return build(JointMove, target=goal, **_wire(options))


def linear(target: Place | Mapping[str, Place], **options: Unpack[LinearOptions]) -> LinearMove:
    """A straight line to x, y, z or a `pose`; for a compound group to one for each member that moves, by name."""
    oriented, rest = _split(options)
    if not isinstance(target, Mapping):
        return build(LinearMove, target=_pose(target, oriented), **rest)
    if oriented:
        raise InvalidArgument(f"{', '.join(oriented)}: give each group's target an orientation of its own, by pose()")
    return build(LinearMove, target={name: _pose(place, {}) for name, place in target.items()}, **rest)


def circular(via: Place, target: Place, **options: Unpack[PathOptions]) -> CircularMove:
    """The arc from where the tool is through `via` to `target`."""
    oriented, rest = _split(options)
    return build(CircularMove, via=_pose(via, {}), target=_pose(target, oriented), **rest)


def path(curve: Curve, **options: Unpack[PathOptions]) -> PathMove:
    """Along a `Circle`, which may be a helix, or a `Lissajous`."""
    oriented, rest = _split(options)
    return build(PathMove, curve=curve, end=build(Orientation, **oriented), **rest)


def dwell(duration_s: float) -> Dwell:
    """Standing still, as a step of a sequence."""
    return build(Dwell, duration_s=duration_s)


def sequence(steps: Sequence[SingleMove | Dwell]) -> SequenceMove:
    """Steps one after the other, at rest in between, planned and admitted whole."""
    return build(SequenceMove, steps=tuple(steps))


def build(model: type[M], **values: object) -> M:
    """The model, or InvalidArgument with the path of each fault."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise InvalidArgument(explain(error)) from None


def _pose(place: Place, oriented: Mapping[str, Any]) -> ToolPose:
    if not isinstance(place, ToolPose):
        return pose(place, **oriented)
    if oriented:
        raise InvalidArgument(f"{', '.join(oriented)}: the pose has an orientation of its own")
    return place


def _split(options: PathOptions) -> tuple[dict[str, Any], dict[str, Any]]:
    """Orientation, and the rest of the options, as models take them."""
    wire = _wire(options)
    return {key: wire.pop(key) for key in ("quaternion", "euler_zyz") if key in wire}, wire


def _wire(options: Timing) -> dict[str, Any]:
    """Options that were given, arrays and lists as tuples."""
    given: dict[str, Any] = {key: value for key, value in options.items() if value is not None}
    for key in {"quaternion", "euler_zyz", "linear_limits", "angular_limits"} & given.keys():
        given[key] = as_floats(given[key], key)
    if "contacts" in given:
        given["contacts"] = tuple(tuple(pair) for pair in given["contacts"])
    return given


def _optional(values: Floats | None, name: str) -> tuple[float, ...] | None:
    return None if values is None else as_floats(values, name)
