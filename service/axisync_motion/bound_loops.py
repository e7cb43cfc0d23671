"""The bounds of path_bounds.py as loops over one value at a time, for compiled.py.

The same formulas under the same names once more, since what makes numpy fast makes loops slow. What numba compiles
must all be in here, since its cache is valid while one file is unchanged.
"""

from math import inf

import numpy as np

from .closed_forms import Array


def cell_bounds(knots: Array, coefficients: Array, grid: Array, matrix: Array, out: Array) -> None:
    """As path_bounds.cell_bounds: fills out[cells + 1, 3 * 2n]; matrix[order, order] gives Bernstein coefficients."""
    order, n = coefficients.shape[1], coefficients.shape[2]
    shifted, scaled = np.empty((order, n)), np.empty((order, n))
    piece = 0
    for cell in range(grid.size - 1):
        for c in range(6 * n):
            out[cell, c] = -inf
        low = grid[cell]
        while low < grid[cell + 1]:
            while knots[piece + 1] <= low:
                piece += 1
            high = min(grid[cell + 1], knots[piece + 1])
            shift(coefficients, piece, low - knots[piece], shifted)
            for k in range(1, 4):
                differentiate(shifted, k, high - low, scaled)
                hull(scaled, k, matrix, out, cell, 2 * n * (k - 1))
            low = high
    for c in range(6 * n):
        out[grid.size - 1, c] = 0.0


def shift(coefficients: Array, piece: int, x: float, out: Array) -> None:
    """The piece's polynomials [order, n], expanded about x instead of 0."""
    order, n = out.shape
    for p in range(order):
        for i in range(n):
            out[p, i] = coefficients[piece, p, i]
    for first in range(order - 1):
        for p in range(order - 2, first - 1, -1):
            for i in range(n):
                out[p, i] += x * out[p + 1, i]


def differentiate(polynomials: Array, k: int, width: float, out: Array) -> None:
    """The k-th derivatives' coefficients [order - k, n] by powers of the share of `width`."""
    order, n = out.shape
    power = 1.0
    for p in range(order - k):
        factor = power
        for step in range(p + 1, p + k + 1):
            factor *= step
        for i in range(n):
            out[p, i] = factor * polynomials[p + k, i]
        power *= width


def hull(scaled: Array, k: int, matrix: Array, out: Array, cell: int, column: int) -> None:
    """Raise the bounds of the k-th derivatives and of their negatives to the polynomials' Bernstein coefficients."""
    order, n = scaled.shape
    for row in range(order):
        for i in range(n):
            value = scaled[0, i]
            for p in range(1, min(row, order - 1 - k) + 1):
                value += matrix[row, p] * scaled[p, i]
            out[cell, column + i] = max(out[cell, column + i], value)
            out[cell, column + n + i] = max(out[cell, column + n + i], -value)
