"""MASA, section IV.D: all axes of a move start together and arrive together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import DURATION_TOLERANCE, check_axis, check_duration, floats
from .errors import InfeasibleDuration
from .inverse import Minimise, ShapeMap, shape_map
from .s_curve import (
    Array,
    Curve,
    Profile,
    Pulse,
    Shape,
    capped_acceleration,
    mean_jerk,
    sample_curves,
    signed_peak,
)
from .time_optimal import optimal_shape, shortest

Axis = tuple[float, float, float, float]
"""Distance without sign, v_max, a_max capped by (23), mean jerk."""


@dataclass(frozen=True, slots=True, eq=False)
class SyncProfile:
    """The motion of n axes from 0 to `distances`, all of the same duration, in any consistent units.

    T[n, 7] segment durations and U[n, 7] signed peak jerks; `minimum_durations`[n] is each axis's own shortest
    time and `limiting` the index of the axis with the longest of them.
    """

    T: Array
    U: Array
    duration: float
    distances: Array
    minimum_durations: Array
    limiting: int
    pulse: Pulse = "constant"

    def curve(self) -> Curve[Array]:
        """Parameters for sampling, arrays [n]."""
        tj, ta, j = self.T[:, 0], self.T[:, 1], self.U[:, 0]
        busy = tj + ta + tj + self.T[:, 3]
        velocity = np.divide(self.distances, busy, out=np.zeros_like(busy), where=busy > 0.0)
        acceleration = (j if self.pulse == "constant" else j * 2.0 / 3.0) * tj
        return Curve(tj, ta, acceleration, velocity, j, self.distances, np.full_like(tj, self.duration))

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration, jerk at time t (a float or an array): arrays [*t.shape, n].

        Exact; before 0 and from `duration` on at rest at 0 and at `distances`.
        """
        times = np.asarray(t, dtype=np.float64)[..., np.newaxis]
        states = sample_curves(times, self.curve(), self.pulse)
        return states[0], states[1], states[2], states[3]

    def axis(self, index: int) -> Profile:
        """The profile of one axis."""
        tj, ta, _, tv = self.T[index, :4].tolist()
        j = float(self.U[index, 0])
        series = (tj, ta, tj, tv, tj, ta, tj)
        distance = float(self.distances[index])
        return Profile(series, (j, 0.0, -j, 0.0, -j, 0.0, j), self.duration, distance, self.pulse)


def synchronise(
    distances: Sequence[float] | NDArray[np.float64],
    v_max: Sequence[float] | NDArray[np.float64],
    a_max: Sequence[float] | NDArray[np.float64],
    j_max: Sequence[float] | NDArray[np.float64],
    minimise: Minimise = "acceleration",
    duration: float | None = None,
    pulse: Pulse = "constant",
) -> SyncProfile:
    """MASA: the move of n >= 1 axes over signed distances [n] within limits [n], in any consistent units.

    The slowest axis sets the time and keeps its time-optimal motion, and so do axes that need just as long; the
    others take the inverse map that `minimise` names. With a longer `duration` all axes take that map.
    Raises InvalidLimits, InfeasibleDuration (naming the slowest axis), and ValueError for wrong shapes.
    """
    inverse = shape_map(minimise)
    d = floats("distances", distances)
    n = len(d)
    axes = _axes(d, floats("v_max", v_max, n), floats("a_max", a_max, n), floats("j_max", j_max, n), pulse)
    minimum = [shortest(*axis) for axis in axes]
    t = _common_duration(minimum, duration)
    shapes = [_shape(inverse, t, own, axis) for own, axis in zip(minimum, axes, strict=True)]
    return _sync_profile(shapes, d, t, minimum, pulse)


def _axes(d: list[float], v: list[float], a: list[float], j: list[float], pulse: Pulse) -> list[Axis]:
    if not d:
        raise ValueError("distances: at least one axis is needed")
    for i, axis in enumerate(zip(d, v, a, j, strict=True)):
        check_axis(*axis, i)
    mean = [mean_jerk(ji, pulse) for ji in j]
    capped = map(capped_acceleration, v, a, mean)
    return list(zip(map(abs, d), v, capped, mean, strict=True))


def _common_duration(minimum: list[float], requested: float | None) -> float:
    t_min = max(minimum)
    limiting = minimum.index(t_min)
    check_duration(t_min, limiting)
    if requested is None:
        return t_min
    check_duration(requested)
    if requested < t_min * (1.0 - DURATION_TOLERANCE):
        raise InfeasibleDuration(requested, t_min, limiting)
    return max(float(requested), t_min)


def _shape(inverse: ShapeMap, t: float, own: float, axis: Axis) -> Shape:
    if t <= own:  # a critical axis keeps F: its limits leave no choice
        return optimal_shape(own, *axis)
    return inverse(t, *axis)


def _sync_profile(
    shapes: list[Shape], d: list[float], duration: float, minimum: list[float], pulse: Pulse
) -> SyncProfile:
    series = np.array([(tj, ta, tj, tv, tj, ta, tj) for tj, ta, tv, _ in shapes])
    peak = [signed_peak(shape[3], di, pulse) for shape, di in zip(shapes, d, strict=True)]
    inputs = np.array([(j, 0.0, -j, 0.0, -j, 0.0, j) for j in peak])
    limiting = minimum.index(max(minimum))
    return SyncProfile(series, inputs, duration, np.array(d), np.array(minimum), limiting, pulse)
