"""The bounds of path_bounds.py and the search of stop_table.py as loops over one value at a time, for compiled.py.

The same formulas under the same names once more, since what makes numpy fast makes loops slow. What numba compiles
must all be in here, constants too, since its cache is valid while one file is unchanged.
"""

from math import inf, sqrt

import numpy as np

from .closed_forms import Array

PATH, R2, R3, P, RP, W = range(6)
"""Rows of the terms [6, 2, bins]: lowest and highest value in each bin of what the rate curve contributes."""

ROUNDS = 5  # of looking for something shorter than the first duration that fits
GOOD = 0.95  # share of the room taken that is near enough to all of it
SLACK = 1.0 + 1e-9  # the bounds themselves are rounded
MARGIN = 1e-9  # of a cell, by which windows are widened, so that for rounding none misses a cell it touches


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


def stop_durations(cells: Array, width: float, edges: Array, a: Array, j: Array, terms: Array, out: Array) -> None:
    """As stop_table._search: fills out[k] for beginnings in edges[k + 1], given bounds [rows, 3 * 2n] of cells."""
    table = doubled_windows(cells)
    rows = cells.shape[0]
    q = np.empty(6 * a.size)
    shortest = 0.5 * edges[1]
    for k in range(edges.size - 1):
        low, high = edges[k], edges[k + 1]
        over(table, rows, low / width, high / width, q)
        d = max(guess(q, a, j), shortest)
        best = inf
        rounds = 0
        while True:
            taken = SLACK * load(table, rows, width, low, high, d, a, j, terms, q)
            if taken <= 1.0:
                best = min(best, d)
            rounds += 1
            better = taken < GOOD and d > shortest and rounds < ROUNDS
            if best < inf and not better:
                break
            d = max(d * min(max(1.01 * taken, 0.25), 4.0), shortest)
        out[k] = best


def doubled_windows(cells: Array) -> Array:
    """[levels * rows, 3 * 2n]: in level l the maxima over the 2^l cells from each one on."""
    rows, columns = cells.shape
    levels = 1
    while 1 << levels <= rows:
        levels += 1
    table = np.empty((levels * rows, columns))
    for row in range(rows):
        for c in range(columns):
            table[row, c] = cells[row, c]
    for level in range(1, levels):
        half = 1 << (level - 1)
        for row in range(level * rows, (level + 1) * rows - 2 * half + 1):
            for c in range(columns):
                table[row, c] = max(table[row - rows, c], table[row - rows + half, c])
    return table


def over(table: Array, rows: int, low: float, high: float, q: Array) -> None:
    """As PathBounds.over, for one window in cells: the n axes' q', their negatives, then so for q'' and for q'''."""
    first = min(max(int(low - MARGIN), 0), rows - 1)
    last = min(int(high + MARGIN), rows - 1)
    level = 0
    while 2 << level <= last - first + 1:
        level += 1
    one = level * rows + first
    two = level * rows + last + 1 - (1 << level)
    for c in range(q.size):
        q[c] = max(table[one, c], table[two, c])


def guess(q: Array, a: Array, j: Array) -> float:
    """As stop_table._guess, for one cell."""
    n = a.size
    needed = 0.0
    for sign in range(2):
        up, down = sign * n, (1 - sign) * n
        for i in range(n):
            slowing = q[down + i]
            needed = max(needed, 1.5 * slowing / (a[i] - q[2 * n + up + i]))
            needed = max(needed, sqrt(max(6.0 * slowing / (j[i] - q[4 * n + up + i]), 0.0)))
    return needed


def load(
    table: Array, rows: int, width: float, low: float, high: float, d: float, a: Array, j: Array, terms: Array, q: Array
) -> float:
    """As stop_table._load, for one cell; q[6n] is room to work in."""
    n, bins = a.size, terms.shape[2]
    inverse = 1.0 / d
    worst_a = worst_j = 0.0
    for k in range(bins):
        over(table, rows, (low + d * terms[PATH, 0, k]) / width, (high + d * terms[PATH, 1, k]) / width, q)
        r2_low, r2_high, r3_low, r3_high = terms[R2, 0, k], terms[R2, 1, k], terms[R3, 0, k], terms[R3, 1, k]
        p_low, p_high = inverse * terms[P, 0, k], inverse * terms[P, 1, k]
        rp_low, rp_high = 3.0 * inverse * terms[RP, 0, k], 3.0 * inverse * terms[RP, 1, k]
        w_low, w_high = inverse * inverse * terms[W, 0, k], inverse * inverse * terms[W, 1, k]
        for sign in range(2):
            up, down = sign * n, (1 - sign) * n
            bend, bend_low, bend_high = up, w_low, w_high
            if 2 * k < bins:  # the rate's second derivative is negative first, then positive
                bend, bend_low, bend_high = down, -w_high, -w_low
            for i in range(n):
                n1, n2, bent = q[down + i], q[2 * n + down + i], q[bend + i]
                q2, q3 = q[2 * n + up + i], q[4 * n + up + i]
                slowing = max(n1 * p_low, n1 * p_high)
                room = a[i] - max(q2 * r2_low, q2 * r2_high)
                if slowing > worst_a * room:  # seldom, so that there are few divisions
                    worst_a = slowing / room
                slowing = max(n2 * rp_low, n2 * rp_high) + max(bent * bend_low, bent * bend_high)
                room = j[i] - max(q3 * r3_low, q3 * r3_high)
                if slowing > worst_j * room:
                    worst_j = slowing / room
    return max(worst_a, sqrt(worst_j))
