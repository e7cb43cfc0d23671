"""Trajectories: piecewise polynomials of n axes over one path parameter, and their evaluation in the cycle.

Evaluation is Horner's rule with + and * in one fixed order, elementwise: the same bits on every machine, one
value at a time or a thousand.
"""

from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy import add, multiply
from numpy.typing import ArrayLike, NDArray

from .closed_forms import Array

DERIVATIVES = 4  # position and the first three derivatives


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Motion of n axes, m polynomial segments over the path parameter s (seconds at rate 1).

    The arrays may be views of shared memory; they are not copied and must not be written to.
    """

    knots: Array
    """[m+1], knots[0] == 0, strictly increasing."""
    coefficients: Array
    """[m, order, n], ascending powers of (s - knots[i])."""
    start: Array
    """[n], the position at s <= 0."""
    end: Array
    """[n], the position at s >= duration, bit for bit the target."""

    def __post_init__(self) -> None:
        n = self.start.shape[0]
        m = self.knots.shape[0] - 1
        expected = (m, self.coefficients.shape[1], n)
        if self.end.shape != (n,) or self.coefficients.shape != expected or expected[1] < DERIVATIVES:
            raise ValueError(
                f"shapes do not agree: knots {self.knots.shape}, coefficients {self.coefficients.shape}, "
                f"start {self.start.shape}, end {self.end.shape}"
            )

    @property
    def duration(self) -> float:
        """Length of the path in s."""
        return float(self.knots[-1])

    def evaluate(self, s: float) -> tuple[Array, Array, Array, Array]:
        """Position and its first three derivatives by s, arrays [n]; at rest at the ends outside of [0, duration).

        For a loop use Evaluator, which gives the same bits sooner.
        """
        return Evaluator(self).at(s)

    def sample(self, s: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """As `evaluate` at many s[k]: arrays [k, n], the same bits."""
        values = np.asarray(s, dtype=np.float64)
        last = self.knots.shape[0] - 2
        out = np.zeros((DERIVATIVES, values.shape[0], self.start.shape[0]))
        before, after = values < 0.0, values >= self.duration
        if last >= 0:
            index = np.clip(np.searchsorted(self.knots, values, side="right") - 1, 0, last)
            x = (values - self.knots[index])[:, np.newaxis]
            chosen = self.coefficients
            if values.size <= last:  # fewer samples than segments
                chosen, index = chosen[index], np.arange(values.size)
            _horner(derivative_table(chosen).transpose(1, 2, 0, 3), index, x, out)
        out[:, before | after] = 0.0
        out[0, before] = self.start
        out[0, after] = self.end
        return out[0], out[1], out[2], out[3]


class Evaluator:
    """Evaluates one trajectory at one s after the other, with buffers of its own and almost no allocation.

    Making one costs a few microseconds and copies the knots only.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        n = trajectory.start.shape[0]
        order = trajectory.coefficients.shape[1]
        self.trajectory = trajectory
        self._coefficients = trajectory.coefficients
        self._knots: list[float] = trajectory.knots.tolist()
        self._duration = self._knots[-1]
        self._index = -1
        self._source, factor = _differentiation(order)
        self._factor = factor[:, :, np.newaxis]
        self._table = np.zeros((order, DERIVATIVES, n))
        self._highest, *self._lower, self._lowest = self._table[::-1]
        self._out = np.zeros((DERIVATIVES, n))
        self._result = (self._out[0], self._out[1], self._out[2], self._out[3])

    def at(self, s: float) -> tuple[Array, Array, Array, Array]:
        """Position and its first three derivatives by s, arrays [n] that the next call overwrites."""
        if s < 0.0:
            return self._rest(self.trajectory.start)
        if s >= self._duration:
            return self._rest(self.trajectory.end)
        index = bisect_right(self._knots, s) - 1
        if index != self._index:
            self._enter(index)
        x, out = s - self._knots[index], self._out
        multiply(self._highest, x, out)
        for row in self._lower:
            add(out, row, out)
            multiply(out, x, out)
        add(out, self._lowest, out)
        return self._result

    def _enter(self, index: int) -> None:
        """Differentiate the segment's polynomials: the table that Horner's rule then runs over."""
        np.take(self._coefficients[index], self._source, axis=0, out=self._table, mode="clip")
        np.multiply(self._table, self._factor, out=self._table)
        self._index = index

    def _rest(self, position: Array) -> tuple[Array, Array, Array, Array]:
        self._out[0] = position
        self._out[1:] = 0.0
        return self._result


@lru_cache(maxsize=16)
def _differentiation(order: int) -> tuple[NDArray[np.intp], Array]:
    """[order, 4]: which coefficient becomes that of power p in the k-th derivative, and times what."""
    power, k = np.meshgrid(np.arange(order), np.arange(DERIVATIVES), indexing="ij")
    source = power + k
    factor = np.where(source < order, 1.0, 0.0)
    for step in range(DERIVATIVES):
        factor *= np.where(step < k, source - step, 1)
    return np.minimum(source, order - 1), factor


def derivative_table(coefficients: Array) -> Array:
    """[..., order, n] polynomials as [..., order, 4, n]: theirs and their first three derivatives' coefficients."""
    source, factor = _differentiation(coefficients.shape[-2])
    table: Array = np.take(coefficients, source, axis=-2) * factor[:, :, np.newaxis]
    return table


def _horner(table: Array, index: NDArray[np.intp], x: Array, out: Array) -> None:
    """Evaluate ascending coefficients [order, 4, m, n], those at `index` [k], at x [k, 1], in Evaluator.at's order."""
    multiply(table[-1].take(index, axis=1), x, out)
    for row in table[-2:0:-1]:
        add(out, row.take(index, axis=1), out)
        multiply(out, x, out)
    add(out, table[0].take(index, axis=1), out)


def concatenate(trajectories: list[Trajectory], dwells: list[float] | None = None) -> Trajectory:
    """Multi-point moves, section V.C.1: one trajectory of several, `dwells`[k-1] seconds of rest between them.

    Each must start, to the bit, where the one before it ends (ValueError names the axis otherwise).
    """
    if not trajectories:
        raise ValueError("trajectories: at least one is needed")
    rests = [0.0] * (len(trajectories) - 1) if dwells is None else [float(d) for d in dwells]
    if len(rests) != len(trajectories) - 1 or not all(0.0 <= d < float("inf") for d in rests):
        raise ValueError(f"dwells: expected {len(trajectories) - 1} finite times >= 0, got {rests}")
    _check_joints(trajectories)
    parts = [trajectories[0]]
    for rest, trajectory in zip(rests, trajectories[1:], strict=True):
        if rest > 0.0:
            parts.append(dwell(trajectory.start, rest))
        parts.append(trajectory)
    return _join(parts)


def _check_joints(trajectories: list[Trajectory]) -> None:
    for index, (one, two) in enumerate(pairwise(trajectories)):
        if one.end.shape != two.start.shape:
            raise ValueError(f"trajectory {index + 1}: {two.start.size} axes after {one.end.size}")
        gap = one.end != two.start
        if gap.any():
            axis = int(np.argmax(gap))
            raise ValueError(
                f"trajectory {index + 1}, axis {axis}: starts at {float(two.start[axis])!r}, "
                f"the one before ends at {float(one.end[axis])!r}"
            )


def dwell(position: Array, duration: float) -> Trajectory:
    """Rest at `position` [n] for `duration` > 0 seconds."""
    coefficients = np.zeros((1, DERIVATIVES, position.size))
    coefficients[0, 0] = position
    return Trajectory(np.array([0.0, duration]), coefficients, position, position)


def _join(parts: list[Trajectory]) -> Trajectory:
    order = max(part.coefficients.shape[1] for part in parts)
    knots, blocks, offset = [np.zeros(1)], [], 0.0
    for part in parts:
        shifted = part.knots + offset
        # Shifted far along the path, a segment may round to nothing; its motion is below the resolution of s.
        keep = np.diff(shifted) > 0.0
        coefficients = part.coefficients[keep]
        pad = order - coefficients.shape[1]
        blocks.append(np.pad(coefficients, ((0, 0), (0, pad), (0, 0))))
        knots.append(shifted[1:][keep])
        offset = float(shifted[-1])
    return Trajectory(np.concatenate(knots), np.concatenate(blocks), parts[0].start.copy(), parts[-1].end.copy())
