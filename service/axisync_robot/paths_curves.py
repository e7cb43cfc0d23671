"""Lines, arcs, circles and helices by their arc length, exactly.

All are evaluated as offsets from the start, so that rounding is relative to the length of the path and not to the
radius of a very flat arc.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from axisync_robot.paths_errors import (
    CollinearArcPoints,
    EqualArcPoints,
    OutOfRange,
    StartOnAxis,
    ZeroCurve,
    ZeroNormal,
)
from axisync_schemas.moves import MAX_TURNS

Array = NDArray[np.float64]

RADIUS_MAX = 1000.0
"""m: the points of a flatter arc are collinear; over a metre it leaves the line by 0.1 mm."""
LENGTH_MIN = 1e-6
"""m: no curve, radius or distance between an arc's points may be shorter: its direction would be rounding."""
COORDINATE_MAX = 1e6
"""m: far beyond any arm, and far from overflow."""
NORMAL_MIN = 1e-9
NOTHING = 1e-15
"""m and rad: what rounding leaves of no distance, and no more than the ends of a path may be off."""


class Curve(Protocol):
    """A curve of the tool's position in O. Attributes: `length` (m)."""

    @property
    def length(self) -> float: ...

    def at(self, lengths: Array) -> Array:
        """Positions [k, 3], m, at arc lengths [k], m, from 0 to `length`."""
        ...


def checked(values: Array, name: str, bound: float = COORDINATE_MAX, unit: str = "m") -> Array:
    """The same values.

    Raises:
        OutOfRange: one is beyond the bound, or not a number.
    """
    wrong = ~(np.abs(values) <= bound)
    if wrong.any():
        raise OutOfRange(float(values[wrong][0]), bound, name, unit)
    return values


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """From `start` [3] along the unit vector `direction` [3]; of no length: the start alone."""

    start: Array
    direction: Array
    length: float

    def at(self, lengths: Array) -> Array:
        """As `Curve.at`."""
        positions: Array = self.start + lengths[:, None] * self.direction
        return positions


def line_between(start: Array, target: Array) -> Line:
    """From start [3] to target [3], m.

    Raises:
        OutOfRange: the target is absurdly far.
    """
    offset = checked(target, "target") - start
    length = _length(offset)
    if length < NOTHING:
        return Line(start, np.zeros(3), 0.0)
    return Line(start, offset / length, length)


@dataclass(frozen=True, slots=True, eq=False)
class Helix:
    """About the unit vector `normal` by `angle` (rad, signed, right-handed); a circle where `rise` is 0.

    Attributes:
        start: [3], m.
        outward: [3], from the axis to the start, of unit length, normal to `normal`.
        forward: [3], normal x outward: the direction of the tool at the start for a positive angle.
        radius: m. rise: m along the normal for each rad.
    """

    start: Array
    outward: Array
    forward: Array
    normal: Array
    radius: float
    angle: float
    rise: float = 0.0

    @property
    def length(self) -> float:
        """m."""
        return abs(self.angle) * math.hypot(self.radius, self.rise)

    @property
    def end(self) -> Array:
        """[3], m: after whole turns of a circle exactly the start."""
        rest = self.angle - math.tau * round(self.angle / math.tau)
        around = self._offsets(np.array([rest]))[0]
        position: Array = self.start + around + self.rise * self.angle * self.normal
        return position

    def at(self, lengths: Array) -> Array:
        """As `Curve.at`."""
        angles = lengths * math.copysign(1.0 / math.hypot(self.radius, self.rise), self.angle)
        positions: Array = self.start + self._offsets(angles)
        if self.rise:
            positions += (self.rise * angles)[:, None] * self.normal
        return positions

    def _offsets(self, angles: Array) -> Array:
        # 1 - cos as 2 sin^2 of the half: no digits cancel on flat arcs.
        half = np.sin(0.5 * angles)
        terms = np.stack([np.sin(angles), 2.0 * half * half], axis=-1)
        offsets: Array = terms @ (self.radius * np.stack([self.forward, -self.outward]))
        return offsets


def arc_through(start: Array, via: Array, target: Array) -> Helix:
    """The arc from start through via to target, each [3], m.

    Its angle is twice the one by which the chords turn at via (inscribed angles), its radius the circumradius.

    Raises:
        EqualArcPoints, CollinearArcPoints, OutOfRange
    """
    first, second = checked(via, "via") - start, checked(target, "target") - via
    chord = target - start
    _refuse_equal(_length(first), _length(second), _length(chord))
    cross = np.cross(first, chord)
    sides, double_area = _length(first) * _length(second), _length(cross)
    away, needed = double_area / _length(chord), sides / (2.0 * RADIUS_MAX)
    if away < needed:
        raise CollinearArcPoints(away, needed, RADIUS_MAX)
    half = math.atan2(double_area, float(first @ second))
    normal, along = cross / double_area, chord / _length(chord)
    left = np.cross(normal, along)
    sine, cosine = math.sin(half), math.cos(half)
    return Helix(
        start=start,
        outward=-(sine * along + cosine * left),
        forward=cosine * along - sine * left,
        normal=normal,
        radius=sides / (2.0 * away),
        angle=2.0 * half,
    )


def _refuse_equal(to_via: float, from_via: float, chord: float) -> None:
    pairs = ((chord, "start", "target"), (to_via, "start", "via"), (from_via, "via", "target"))
    for apart, first, second in pairs:
        if apart < LENGTH_MIN:
            raise EqualArcPoints(apart, LENGTH_MIN, first, second)


def helix_around(start: Array, centre: Array, normal: Array, angle: float, pitch: float) -> Helix:
    """From start [3] about the axis through centre [3] along normal [3]; pitch in m for each turn along the normal.

    Raises:
        ZeroNormal, StartOnAxis, ZeroCurve, OutOfRange
    """
    axis = _unit_normal(checked(normal, "normal", unit="by component"))
    checked(np.array([pitch]), "pitch")
    checked(np.array([angle]), "angle", MAX_TURNS * math.tau, "rad")
    arm = start - checked(centre, "centre")
    arm -= (arm @ axis) * axis
    # Once more: what rounding of a long first projection leaves along the axis.
    arm -= (arm @ axis) * axis
    radius = _length(arm)
    if radius < LENGTH_MIN:
        raise StartOnAxis(radius, LENGTH_MIN)
    outward = arm / radius
    helix = Helix(start, outward, np.cross(axis, outward), axis, radius, angle, pitch / math.tau)
    if helix.length < LENGTH_MIN:
        raise ZeroCurve(helix.length, LENGTH_MIN, "circle" if pitch == 0.0 else "helix")
    return helix


def _unit_normal(normal: Array) -> Array:
    length = _length(normal)
    if length < NORMAL_MIN:
        raise ZeroNormal(length, NORMAL_MIN)
    unit: Array = normal / length
    return unit


def _length(vector: Array) -> float:
    return math.hypot(*vector.tolist())
