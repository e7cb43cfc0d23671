"""Rigorous bounds of a trajectory's derivatives over windows of the path."""

from functools import lru_cache
from math import comb

import numpy as np

from .backends import kernels
from .closed_forms import Array
from .trajectory import Trajectory, derivative_table


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
