"""How a tool turns from one orientation to another: about one axis, or each ZYZ angle for itself (the paper, V.B.2)."""

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from axisync_robot.paths_curves import NOTHING
from axisync_robot.poses import ZYZ_SINGULAR, rotation_of_zyz, vector_of_rotation, zyz_of_rotation

Array = NDArray[np.float64]

Orientation = Literal["rotation_vector", "euler_zyz"]

_TIE = 1e-9
"""rad: of two ways that differ by less in length the first is taken, whatever their rounding."""


class Turn(Protocol):
    """Attributes: `names` and `distances` [m] (rad, signed) of the angles that it needs."""

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def distances(self) -> Array: ...

    def at(self, values: Array) -> Array:
        """Rotations [k, 3, 3] at angles [k, m], rad, from 0 to `distances`."""
        ...


def turn_between(start: Array, target: Array, orientation: Orientation) -> Turn:
    """From rotation start [3, 3] to target [3, 3]."""
    return _about_one_axis(start, target) if orientation == "rotation_vector" else _by_zyz(start, target)


@dataclass(frozen=True, slots=True, eq=False)
class AxisTurn:
    """About an axis fixed in the tool and in O: the shortest way. R = start + sin(x) `sine` + (1 - cos(x)) `versine`.

    The two [3, 3] are start K and start K K, with K the cross product by the axis (Rodrigues).
    """

    start: Array
    sine: Array
    versine: Array
    distances: Array
    names: tuple[str, ...] = ("rotation",)

    def at(self, values: Array) -> Array:
        """As `Turn.at`."""
        angle = values[:, 0]
        half = np.sin(0.5 * angle)
        terms = np.stack([np.sin(angle), 2.0 * half * half], axis=-1)
        turned: Array = terms @ np.stack([self.sine.ravel(), self.versine.ravel()])
        turned += self.start.ravel()
        return turned.reshape(-1, 3, 3)


def _about_one_axis(start: Array, target: Array) -> AxisTurn:
    vector = vector_of_rotation(start.T @ target)
    angle = float(np.linalg.norm(vector))
    if angle < NOTHING:
        return AxisTurn(start, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(1))
    x, y, z = (vector / angle).tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return AxisTurn(start, start @ cross, start @ cross @ cross, np.array([angle]))


@dataclass(frozen=True, slots=True, eq=False)
class ZyzTurn:
    """Each angle for itself, from `first` (alpha, beta, gamma; rad)."""

    first: Array
    distances: Array
    names: tuple[str, ...] = ("alpha", "beta", "gamma")

    def at(self, values: Array) -> Array:
        """As `Turn.at`."""
        return rotation_of_zyz(self.first + values)


def _by_zyz(start: Array, target: Array) -> ZyzTurn:
    """The shortest way for each angle, between those of the two representations with the least sum of changes.

    (a, b, g) and (a + pi, -b, g + pi) are one rotation. Changing both ends alike changes nothing, so the start keeps
    its own.
    """
    first, last = _matched(zyz_of_rotation(start), zyz_of_rotation(target))
    other = last * np.array([1.0, -1.0, 1.0]) + np.array([math.pi, 0.0, math.pi])
    ways = np.stack([_shortest(last - first), _shortest(other - first)])
    total = np.abs(ways).sum(axis=1)
    way = ways[1] if total[1] < total[0] - _TIE else ways[0]
    return ZyzTurn(first, np.where(np.abs(way) < NOTHING, 0.0, way))


def _matched(first: Array, last: Array) -> tuple[Array, Array]:
    """Where one of the two is singular, its gamma is free: it takes the other's, so that only alpha turns."""
    if _singular(first) and not _singular(last):
        return _with_gamma(first, last[2]), last
    if _singular(last) and not _singular(first):
        return first, _with_gamma(last, first[2])
    return first, last


def _singular(angles: Array) -> bool:
    return math.sin(angles[1]) < ZYZ_SINGULAR


def _with_gamma(angles: Array, gamma: float) -> Array:
    # Fixed are alpha + gamma at beta = 0, and alpha - gamma at 180 deg.
    sign = 1.0 if angles[1] < 1.0 else -1.0
    return np.array([angles[0] + sign * (angles[2] - gamma), angles[1], gamma])


def _shortest(angles: Array) -> Array:
    return angles - math.tau * np.rint(angles / math.tau)
