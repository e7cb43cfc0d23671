"""What may be moved, and how: the MOVE of `move` and `plan`. SI units: rad, m, s."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from axisync_schemas.base import Name, Strict

MAX_AXES = 64
MAX_STEPS = 256
MAX_TURNS = 100.0
UNIT_TOLERANCE = 1e-3
"""A quaternion whose length is off by no more than this is normalised; a worse one is no rounding but an error."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Positive = Annotated[float, Field(gt=0)]
PathLimits = tuple[Positive, Positive, Positive]
"""Velocity, acceleration and jerk along a path: m/s, m/s^2, m/s^3, or rad/s, rad/s^2, rad/s^3."""
Frame = Literal["base", "body", "tool"]
"""base: of the arm's own base; body: O of the cell; tool: where the tool is when the move begins."""


class Orientation(Strict):
    """An orientation, or none (the one it has is kept).

    Attributes:
        quaternion: x, y, z, w, of unit length within 1e-3.
        euler_zyz: intrinsic, rad: R = Rz(a) Ry(b) Rz(g), the paper's.
    """

    quaternion: Quaternion | None = None
    euler_zyz: Vector | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.quaternion is not None and self.euler_zyz is not None:
            raise ValueError("quaternion or euler_zyz, not both")
        if self.quaternion is not None:
            length = math.hypot(*self.quaternion)
            if abs(length - 1.0) > UNIT_TOLERANCE:
                raise ValueError(f"quaternion has length {length:.9g}: must be 1 within {UNIT_TOLERANCE:g}")
        return self

    @property
    def given(self) -> bool:
        """Some orientation is named."""
        return self.quaternion is not None or self.euler_zyz is not None


class ToolPose(Orientation):
    """Where the tool's frame is to be; without an orientation it keeps the one it has."""

    position: Vector


class _Timed(Strict):
    """How MASA times the move.

    Attributes:
        minimise: which limit is lowered on the scalars that have time to spare.
        duration_s: a longer duration than the shortest possible one.
        pulse: shape of the jerk: "parabolic" has continuous jerk.
        contacts: pairs of the cell file's geometry.contacts that may touch during this move.
    """

    minimise: Literal["acceleration", "velocity", "jerk"] = "acceleration"
    duration_s: Annotated[float, Field(gt=0, le=86400)] | None = None
    pulse: Literal["constant", "parabolic"] = "constant"
    contacts: tuple[tuple[Name, Name], ...] = Field(max_length=16, default=())


def _tag_of_joints(value: Any) -> str:
    return "values" if isinstance(value, tuple | list) else "pose"


def _tag_of_poses(value: Any) -> str:
    one = not isinstance(value, dict) or not value.keys().isdisjoint(("position", "quaternion", "euler_zyz"))
    return "pose" if one else "poses"


_Values = Annotated[tuple[float, ...], Field(min_length=1, max_length=MAX_AXES)]
_JointTarget = Annotated[
    Annotated[_Values, Tag("values")] | Annotated[ToolPose, Tag("pose")], Discriminator(_tag_of_joints)
]
_PoseTarget = Annotated[
    Annotated[ToolPose, Tag("pose")] | Annotated[dict[Name, ToolPose], Tag("poses")], Discriminator(_tag_of_poses)
]


class JointMove(_Timed):
    """All axes arrive at one time, by MASA.

    Attributes:
        target: rad (m for linear axes), one for each axis of the group, absolute or relative to the setpoint; or a
            pose, which is reached in the configuration nearest the present one.
        frame: what a pose is given in.
    """

    kind: Literal["joint"] = "joint"
    target: _JointTarget
    relative: bool = False
    frame: Frame = "base"


class _Cartesian(_Timed):
    """A path of the tool, mapped into joints.

    Attributes:
        frame: what poses, centres and directions are given in.
        linear_limits, angular_limits: along the path; the cell file's where they are not given.
        orientation: how it is interpolated: along one rotation vector, or each ZYZ angle for itself.
        retime: stretch the move until every joint keeps its limits, instead of refusing it.
    """

    frame: Frame = "base"
    linear_limits: PathLimits | None = None
    angular_limits: PathLimits | None = None
    orientation: Literal["rotation_vector", "euler_zyz"] = "rotation_vector"
    retime: bool = True


class LinearMove(_Cartesian):
    """A straight line.

    Attributes:
        target: for a compound group one pose for each member that is to move, by its name.
        relative: the target is an offset from where the tool is: along and about the axes of `frame`.
    """

    kind: Literal["linear"] = "linear"
    target: _PoseTarget
    relative: bool = False

    def targets(self, members: tuple[str, ...]) -> Mapping[str, ToolPose]:
        """Pose by elementary group.

        Raises:
            ValueError: says which groups are expected.
        """
        if isinstance(self.target, ToolPose):
            if len(members) != 1:
                raise ValueError(f"one pose for each of {', '.join(members)} is expected, by name")
            return {members[0]: self.target}
        for name in self.target:
            if name not in members:
                raise ValueError(f"{name} is none of {', '.join(members)}")
        if not self.target:
            raise ValueError(f"a pose for at least one of {', '.join(members)} is expected")
        return self.target


class CircularMove(_Cartesian):
    """The arc from where the tool is through `via` (whose orientation does not count) to `target`."""

    kind: Literal["circular"] = "circular"
    via: ToolPose
    target: ToolPose


class Circle(Strict):
    """Around an axis through `centre` along `normal`, right-handed, from where the tool is; `angle` beyond a turn too.

    With `pitch` (m for each turn, along the normal) it is a helix.
    """

    type: Literal["circle", "helix"] = "circle"
    centre: Vector
    normal: Vector = (0.0, 0.0, 1.0)
    angle: float = Field(default=2.0 * math.pi, ge=-MAX_TURNS * 2 * math.pi, le=MAX_TURNS * 2 * math.pi)
    pitch: float = 0.0


class Lissajous(Strict):
    """p(u) = start + amplitude (sin(2 pi frequency u + phase) - sin(phase)) for each coordinate, u from 0 to 1."""

    type: Literal["lissajous"] = "lissajous"
    amplitude: Vector
    frequency: Vector
    phase: Vector = (0.0, 0.0, 0.0)


Curve = Annotated[Circle | Lissajous, Field(discriminator="type")]


class PathMove(_Cartesian):
    """Along a parametric curve, to `end` as orientation."""

    kind: Literal["path"] = "path"
    curve: Curve
    end: Orientation = Orientation()


class Dwell(Strict):
    """Standing still."""

    kind: Literal["dwell"] = "dwell"
    duration_s: float = Field(gt=0, le=3600)


Step = Annotated[JointMove | LinearMove | CircularMove | PathMove | Dwell, Field(discriminator="kind")]


class SequenceMove(Strict):
    """Steps one after the other, at rest in between, each from where the one before ends; admitted whole."""

    kind: Literal["sequence"] = "sequence"
    steps: tuple[Step, ...] = Field(min_length=1, max_length=MAX_STEPS)


TAGS = frozenset({"joint", "linear", "circular", "path", "sequence", "dwell", "values", "pose", "poses"} | {"circle"} |
                 {"helix", "lissajous"})  # fmt: skip
"""What pydantic adds to the path of a fault to say which kind it took the value for; no key of a request."""

SingleMove = JointMove | LinearMove | CircularMove | PathMove


NO_KIND = "no_kind"
"""Type of the fault of a move whose `kind` is none of these."""


def _kind(value: Any) -> Any:
    return value.get("kind", "joint") if isinstance(value, dict) else getattr(value, "kind", None)


Move = Annotated[
    Annotated[JointMove, Tag("joint")]
    | Annotated[LinearMove, Tag("linear")]
    | Annotated[CircularMove, Tag("circular")]
    | Annotated[PathMove, Tag("path")]
    | Annotated[SequenceMove, Tag("sequence")],
    Discriminator(
        _kind, custom_error_type=NO_KIND, custom_error_message="must be joint, linear, circular, path or sequence"
    ),
]
