"""The path of a tool in O, the cell's frame, independent of time: where it goes and how it turns on the way.

A path has a few scalars, its length and one or three angles, that MASA synchronises; each set of their values is a
pose.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_robot.paths_curves import Curve, arc_through, helix_around, line_between
from axisync_robot.paths_errors import PathError
from axisync_robot.paths_lissajous import lissajous_from
from axisync_robot.paths_turns import Orientation, Turn, turn_between
from axisync_robot.poses import pose_of

__all__ = ["Orientation", "PathError", "ToolPath", "arc", "circle", "line", "lissajous"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ToolPath:
    """Geometry of one move of a tool.

    Attributes:
        names: ("length", "rotation") or ("length", "alpha", "beta", "gamma").
        distances: [m], how far each scalar goes; the length in m, not negative; angles in rad.
        angular: [m], which scalars keep angular limits.
        start, end: [4, 4] in O.
    """

    names: tuple[str, ...]
    distances: Array
    angular: NDArray[np.bool_]
    start: Array
    end: Array
    _curve: Curve = field(repr=False)
    _turn: Turn = field(repr=False)
    _offset: Array = field(repr=False)
    """[9], what rounding keeps the turn's first rotation from the start's."""
    _drift: Array = field(repr=False)
    """[m, 12], for each scalar: what takes position and rotation, rounding apart, exactly to the end."""

    def poses(self, values: ArrayLike) -> Array:
        """Poses [k, 4, 4] in O at scalars [k, m], from 0 to `distances`; smooth, and exact at both ends."""
        scalars = np.asarray(values, dtype=np.float64)
        positions, rotations = self._curve.at(scalars[:, 0]), self._turn.at(scalars[:, 1:])
        positions += scalars @ self._drift[:, :3]
        rotations += (scalars @ self._drift[:, 3:] + self._offset).reshape(-1, 3, 3)
        return pose_of(positions, rotations)


def line(start: ArrayLike, target: ArrayLike, orientation: Orientation = "rotation_vector") -> ToolPath:
    """Straight from pose start to pose target, [4, 4] in O; turning on the spot, or standing still, is one too.

    Raises:
        OutOfRange: the target is absurdly far.
    """
    first, last = _pose(start), _pose(target)
    return _path(first, last, line_between(first[:3, 3], last[:3, 3]), orientation)


def arc(start: ArrayLike, via: ArrayLike, target: ArrayLike, orientation: Orientation = "rotation_vector") -> ToolPath:
    """The arc from pose start through the position via [3] to pose target, in O.

    Raises:
        EqualArcPoints: two of the points are one.
        CollinearArcPoints: they lie on a line, or on an arc of more than 1000 m radius.
        OutOfRange: a point is absurdly far.
    """
    first, last = _pose(start), _pose(target)
    return _path(first, last, arc_through(first[:3, 3], _vector(via), last[:3, 3]), orientation)


def circle(
    start: ArrayLike,
    centre: ArrayLike,
    normal: ArrayLike,
    angle: float,
    pitch: float = 0.0,
    end_rotation: ArrayLike | None = None,
    orientation: Orientation = "rotation_vector",
) -> ToolPath:
    """From pose start about the axis through centre [3] along normal [3], in O, right-handed by angle (rad).

    The angle may be negative and exceed a turn. With a pitch, m along the normal for each turn, it is a helix. The tool
    turns to end_rotation [3, 3], or keeps its orientation.

    Raises:
        ZeroNormal, StartOnAxis, ZeroCurve, OutOfRange
    """
    first = _pose(start)
    helix = helix_around(first[:3, 3], _vector(centre), _vector(normal), float(angle), float(pitch))
    return _path(first, _ended(first, helix.end, end_rotation), helix, orientation)


def lissajous(
    start: ArrayLike,
    amplitude: ArrayLike,
    frequency: ArrayLike,
    phase: ArrayLike,
    end_rotation: ArrayLike | None = None,
    orientation: Orientation = "rotation_vector",
) -> ToolPath:
    """p(u) = start + amplitude (sin(2 pi frequency u + phase) - sin(phase)) for each coordinate of O, u from 0 to 1.

    Amplitude (m), frequency and phase (rad) are [3]. The tool turns to end_rotation [3, 3], or keeps its orientation.

    Raises:
        Cusp: somewhere the curve stops and turns back.
        ZeroCurve, OutOfRange
    """
    first = _pose(start)
    curve = lissajous_from(first[:3, 3], _vector(amplitude), _vector(frequency), _vector(phase))
    return _path(first, _ended(first, curve.end, end_rotation), curve, orientation)


def _path(start: Array, end: Array, curve: Curve, orientation: Orientation) -> ToolPath:
    turn = turn_between(start[:3, :3], end[:3, :3], orientation)
    distances = np.concatenate([[curve.length], turn.distances])
    angular = np.arange(len(distances)) > 0
    offset = start[:3, :3] - turn.at(np.zeros((1, len(turn.distances))))[0]
    moved = end[:3, 3] - curve.at(distances[:1])[0]
    turned = end[:3, :3] - turn.at(turn.distances[None])[0] - offset
    drift = np.hstack(
        [np.outer(_fraction(distances, ~angular), moved), np.outer(_fraction(distances, angular), turned)]
    )
    return ToolPath(("length", *turn.names), distances, angular, start, end, curve, turn, offset.ravel(), drift)


def _fraction(distances: Array, preferred: NDArray[np.bool_]) -> Array:
    """[m]: its product with the scalars goes from 0 to 1; by the preferred ones, or the others where those stand."""
    for chosen in (preferred, ~preferred):
        going = np.where(chosen, distances, 0.0)
        if going.any():
            share: Array = going / (going @ going)
            return share
    return np.zeros_like(distances)


def _ended(start: Array, position: Array, rotation: ArrayLike | None) -> Array:
    return pose_of(position, start[:3, :3] if rotation is None else rotation)


def _pose(pose: ArrayLike) -> Array:
    return np.array(pose, dtype=np.float64)


def _vector(vector: ArrayLike) -> Array:
    return np.array(vector, dtype=np.float64)
