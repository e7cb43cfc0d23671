"""The symmetric seven-segment S-curve of one axis: eqs. (9)-(11), its pulses, and exact sampling.

A curve is T = [tj, ta, tj, tv, tj, ta, tj] with jerk U = [j, 0, -j, 0, -j, 0, j]. It is symmetric about its middle,
so all is computed for the rising half and mirrored: the end is reached exactly, not by summing seven segments.
"""

from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from .closed_forms import Array, Shape, signed_peak

Pulse = Literal["constant", "parabolic"]
Series = tuple[float, float, float, float, float, float, float]
X = TypeVar("X", float, Array)

PARABOLIC: dict[Pulse, bool] = {"constant": False, "parabolic": True}
SERIES_ORDER = [0, 1, 0, 2, 0, 1, 0]  # T from (tj, ta, tv)


def mean_jerk(j: X, pulse: Pulse) -> X:
    """Mean of a jerk pulse of peak j. All maps hold with it in J's place if the pulse is symmetric in itself."""
    if pulse == "constant":
        return j
    if pulse == "parabolic":
        return j * 2.0 / 3.0
    raise ValueError(f"pulse = {pulse!r}: must be 'constant' or 'parabolic'")


class Curve(NamedTuple, Generic[X]):
    """What sampling needs of one curve (floats) or of many (arrays). All but times are signed; jerk is the peak."""

    tj: X
    ta: X
    acceleration: X
    velocity: X
    jerk: X
    distance: X
    duration: X


@dataclass(frozen=True, slots=True)
class Profile:
    """One axis's timed motion from 0 to `distance`, at rest at both ends, in any consistent units.

    T[7] segment durations, U[7] peak jerk of each segment, with sign (14); `duration` is the sum of T.
    """

    T: Series
    U: Series
    duration: float
    distance: float
    pulse: Pulse = "constant"

    @property
    def peak_acceleration(self) -> float:
        """Largest acceleration, signed like the distance."""
        return mean_jerk(self.U[0], self.pulse) * self.T[0]

    @property
    def peak_velocity(self) -> float:
        """Largest velocity, signed like the distance."""
        busy = self.T[0] + self.T[1] + self.T[2] + self.T[3]
        return self.distance / busy if busy > 0.0 else 0.0

    def curve(self) -> Curve[float]:
        """Parameters for sampling."""
        a, v = self.peak_acceleration, self.peak_velocity
        return Curve(self.T[0], self.T[1], a, v, self.U[0], self.distance, self.duration)

    @overload
    def sample(self, t: float) -> tuple[float, float, float, float]: ...
    @overload
    def sample(self, t: Array) -> tuple[Array, Array, Array, Array]: ...
    def sample(self, t: float | Array) -> tuple[float, float, float, float] | tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk at time t (a float, or an array of any shape).

        Exact polynomials, eq. (9) as corrected; before 0 and from `duration` on exactly at rest at the ends.
        """
        if isinstance(t, np.ndarray):
            states = sample_curves(t, self.curve(), self.pulse)
            return states[0], states[1], states[2], states[3]
        return self._sample_one(float(t))

    def _sample_one(self, t: float) -> tuple[float, float, float, float]:
        if t < 0.0:
            return 0.0, 0.0, 0.0, 0.0
        if t >= self.duration:
            return self.distance, 0.0, 0.0, 0.0
        mirrored = t > 0.5 * self.duration
        tau = self.duration - t if mirrored else t
        s, v, a, j = rising(_phase(tau, self.T[0], self.T[1]), tau, self.curve(), self.pulse)[:4]
        return (self.distance - s, v, -a, j) if mirrored else (s, v, a, j)


def make_profile(shape: Shape, distance: float, duration: float, pulse: Pulse) -> Profile:
    """A profile from a map's result."""
    tj, ta, tv, mean = shape
    j = signed_peak(mean, distance, pulse == "parabolic")
    return Profile((tj, ta, tj, tv, tj, ta, tj), (j, 0.0, -j, 0.0, -j, 0.0, j), duration, distance, pulse)


def _phase(tau: float, tj: float, ta: float) -> int:
    """Segment of the rising half: 0 jerk up, 1 constant acceleration, 2 jerk down, 3 cruise."""
    if tau < tj:
        return 0
    if tau < tj + ta:
        return 1
    return 2 if tau < 2.0 * tj + ta else 3


def phases(tau: Array, tj: Array, ta: Array) -> NDArray[np.intp]:
    """As _phase, for arrays of one shape."""
    return (tau >= tj).astype(np.intp) + (tau >= tj + ta) + (tau >= 2.0 * tj + ta)


def _ramp(t: X, tj: X, jerk: X, pulse: Pulse) -> tuple[X, X, X, X, X, X]:
    """The first pulse from rest: position and its first five derivatives after t <= tj."""
    zero = 0.0 * t
    if pulse == "constant":
        return jerk * t * t * t / 6.0, jerk * t * t / 2.0, jerk * t, jerk + zero, zero, zero
    x = t / tj
    return (
        jerk * t * t * t * x * (2.5 - x) / 15.0,
        jerk * t * t * x * (2.0 - x) / 3.0,
        jerk * t * x * (2.0 - 4.0 / 3.0 * x),
        4.0 * jerk * x * (1.0 - x),
        4.0 * jerk * (1.0 - 2.0 * x) / tj,
        -8.0 * jerk / tj / tj + zero,
    )


def rising(phase: int, tau: X, curve: Curve[X], pulse: Pulse) -> tuple[X, X, X, X, X, X]:
    """Position and five derivatives at time tau of the rising half, by the polynomial of the given phase.

    Phase 2 is counted back from its end, so that the cruise is entered with exactly the peak velocity.
    """
    tj, ta, a, v, jerk, distance, duration = curve
    zero = 0.0 * tau
    if phase == 0:
        return _ramp(tau, tj, jerk, pulse)
    if phase == 1:
        t = tau - tj
        v1 = a * tj / 2.0
        s1 = a * tj * tj / 6.0 if pulse == "constant" else a * tj * tj * 3.0 / 20.0
        return s1 + v1 * t + a * t * t / 2.0, v1 + a * t, a + zero, zero, zero, zero
    if phase == 2:
        end = 2.0 * tj + ta
        y = end - tau
        s, w, b, j, snap, crackle = _ramp(y, tj, jerk, pulse)
        return v * end / 2.0 - v * y + s, v - w, b, -j, snap, -crackle
    return distance / 2.0 + v * (tau - duration / 2.0), v + zero, zero, zero, zero, zero


def rising_states(tau: Array, phase: NDArray[np.intp], curve: Curve[Array], pulse: Pulse) -> Array:
    """As `rising`, for arrays tau and phase of one shape to which the curve's broadcast: [6, *shape]."""
    out = np.zeros((6, *tau.shape))
    full = np.empty((len(curve), *tau.shape))
    for row, part in zip(full, curve, strict=True):
        row[...] = part
    for p in range(4):
        mask = phase == p
        if mask.any():
            out[:, mask] = rising(p, tau[mask], Curve(*full[:, mask]), pulse)
    return out


def sample_curves(t: Array, curve: Curve[Array] | Curve[float], pulse: Pulse) -> Array:
    """Position, velocity, acceleration, jerk at times t broadcast against the curve's arrays: [4, *shape]."""
    t, *parts = np.broadcast_arrays(t, *curve)
    full: Curve[Array] = Curve(*parts)
    distance, duration = full.distance, full.duration
    mirrored = t > 0.5 * duration
    tau = np.clip(np.where(mirrored, duration - t, t), 0.0, None)
    out = rising_states(tau, phases(tau, full.tj, full.ta), full, pulse)[:4]
    out[0] = np.where(mirrored, distance - out[0], out[0])
    out[2] = np.where(mirrored, -out[2], out[2])
    before, after = t < 0.0, t >= duration
    out[:, before | after] = 0.0
    out[0, after & ~before] = distance[after & ~before]
    return out
