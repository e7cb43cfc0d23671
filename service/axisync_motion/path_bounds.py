"""Rigorous bounds of a trajectory's derivatives over windows of the path."""

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from .backends import kernels
from .closed_forms import Array
from .stop_loops import MARGIN
from .trajectory import Trajectory, derivative_table


class PathBounds:
    """Upper bounds of q', q'', q''' and of their negatives over any window of the path, for many windows at once.

    Over a window the maximum over the cells that it touches bounds them (a sparse table of doubled windows).
    """

    def __init__(self, cells: Array, width: float) -> None:
        """`cells` as of cell_bounds, each of this width."""
        self._cell = width
        self._rows = cells.shape[0]
        self._last = self._rows - 1
        self._count = 1
        self._table = np.ascontiguousarray(cells.transpose(1, 0, 2))

    def over(self, low: Array, high: Array) -> Array:
        """[3, *low.shape, 2n] over the windows low <= s <= high, low >= 0."""
        # Widened by more than the rounding of the division, so that no window misses a cell it touches.
        first = np.clip(low / self._cell - MARGIN, 0, self._last).astype(np.intp)
        last = np.minimum(high / self._cell + MARGIN, self._last).astype(np.intp)
        level = self._level_of(last - first + 1)
        self._grow(int(level.max()))
        rows = level * self._rows
        one = self._table.take(rows + first, axis=1)
        two = self._table.take(rows + last + 1 - (1 << level), axis=1)
        bounds: Array = np.maximum(one, two, out=one)
        return bounds

    def _level_of(self, length: NDArray[np.intp]) -> NDArray[np.intp]:
        powers = 1 << np.arange(1, int(length.max()).bit_length() + 1)
        return np.searchsorted(powers, length, side="right")

    def _grow(self, level: int) -> None:
        """Append levels up to `level`: level l holds the maxima over the 2^l cells from each one on."""
        for below in range(self._count - 1, level):
            half = self._table[:, below * self._rows :]
            double = half.copy()
            shift = 1 << below
            if shift < self._rows:
                np.maximum(half[:, :-shift], half[:, shift:], out=double[:, :-shift])
            self._table = np.concatenate([self._table, double], axis=1)
        self._count = max(self._count, level + 1)


def cell_bounds(trajectory: Trajectory, cells: int) -> Array:
    """[cells + 1, 3, 2n] bounds of q', q'', q''' of the n axes, then of their negatives, over equal cells of the path.

    By the Bernstein coefficients of each polynomial, whose hull holds it. The last cell is the rest behind the end.
    """
    grid = np.linspace(0.0, trajectory.duration, cells + 1)
    compiled = kernels()
    if compiled is None:
        return _cell_bounds(trajectory, grid)
    order, n = trajectory.coefficients.shape[1:]
    out = np.empty((cells + 1, 3, 2 * n))
    knots, coefficients = (
        np.require(x, requirements=["C", "A", "W"]) for x in (trajectory.knots, trajectory.coefficients)
    )
    compiled.cell_bounds(knots, coefficients, grid, _to_bernstein(order - 1), out.reshape(cells + 1, -1))
    return out


def _cell_bounds(trajectory: Trajectory, grid: Array) -> Array:
    edges = np.unique(np.concatenate([grid, trajectory.knots]))
    index = np.searchsorted(trajectory.knots, edges[:-1], side="right") - 1
    shifted = expanded(trajectory.coefficients[index], edges[:-1] - trajectory.knots[index])
    hull = _bernstein(derivative_table(shifted)[:, :, 1:], np.diff(edges))
    bounds = np.concatenate([hull.max(axis=1), -hull.min(axis=1)], axis=-1)
    out = np.zeros((grid.size, *bounds.shape[1:]))
    out[:-1] = np.maximum.reduceat(bounds, np.searchsorted(edges, grid[:-1]), axis=0)
    return out


def expanded(coefficients: Array, x: Array) -> Array:
    """The polynomials [m, order, n] expanded about x[m] instead of 0."""
    c = coefficients.copy()
    order = c.shape[1]
    for i in range(order - 1):
        for k in range(order - 2, i - 1, -1):
            c[:, k] += x[:, np.newaxis] * c[:, k + 1]
    return c


def _bernstein(table: Array, width: Array) -> Array:
    """Bernstein coefficients over [0, width] of polynomials [m, order, ...]."""
    degree = table.shape[1] - 1
    powers = width[:, np.newaxis] ** np.arange(degree + 1)
    hull: Array = np.einsum("ip,mp,mpkn->mikn", _to_bernstein(degree), powers, table, optimize=True)
    return hull


@lru_cache(maxsize=8)
def _to_bernstein(degree: int) -> Array:
    """What turns coefficients of powers of x, 0 <= x <= 1, into Bernstein coefficients: their hull holds the values."""
    matrix: Array = np.array([[comb(i, p) / comb(degree, p) for p in range(degree + 1)] for i in range(degree + 1)])
    return matrix
