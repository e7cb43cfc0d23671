"""The sweep of rate_tables.py as loops over one value at a time, for compiled.py.

The same formulas under the same names once more, as in bound_loops.py, and for the same reason. Loops that run along
the path innermost compile to vector instructions.
"""

from math import inf, sqrt

import numpy as np

from .closed_forms import Array

TINY = 1e-30
ROUNDS = 2
THIRD, PER_TURNING = 0, 1
ROOM_J, JERKING, TURNING, ROOM_A, ACCELERATING = 0, 1, 2, 3, 4


def rate_slopes(
    bounds: Array, a: Array, j: Array, width: float, x: Array, rates: Array, shares: Array, steepest: Array, out: Array
) -> None:
    """Fills out[3, levels, points] with |w| / x of the three tables.

    `bounds` [points, 3, 2n] as of cell_bounds; a, j [3, n]; `width` of a cell; x [levels]; rates [3, levels];
    shares [3, 3] of u, a and j for each table; steepest [3].
    """
    points, n = bounds.shape[0], a.shape[1]
    moving = 0
    for row in range(2 * n):
        moving += moves(bounds, row)
    bending, pulling = np.empty((2, 2 * n, points)), np.empty((5, moving, points))
    for table in range(3):
        fill_rows(bounds, a[table], j[table], table == 2, bending, pulling)
        sweep(bending, pulling, j[table], width, x, rates[table], shares[table], steepest[table], out[table])


def moves(bounds: Array, row: int) -> bool:
    """Whether an axis ever moves the way that the row stands for."""
    most = 0.0
    for p in range(bounds.shape[0]):
        most = max(most, bounds[p, 0, row])
    return most > 0.0


def fill_rows(bounds: Array, a: Array, j: Array, rising: bool, bending: Array, pulling: Array) -> None:
    """One table's coefficients: bending[2, 2n, points] of every row, pulling[5, moving, points] of those that move."""
    points, n = bounds.shape[0], a.shape[0]
    used = 0
    for row in range(2 * n):
        back, axis, kept = (row + n) % (2 * n), row % n, moves(bounds, row)
        for p in range(points):
            back2 = bounds[p, 1, back]
            third = bounds[p, 2, back if rising else row]
            bending[THIRD, row, p] = third
            bending[PER_TURNING, row, p] = 1.0 / max(3.0 * back2, TINY)
            if kept:
                inverse = 1.0 / max(bounds[p, 0, row], TINY)
                pulling[ROOM_J, used, p] = j[axis] * inverse
                pulling[JERKING, used, p] = third * inverse
                pulling[TURNING, used, p] = 3.0 * back2 * inverse
                pulling[ROOM_A, used, p] = a[axis] * inverse
                pulling[ACCELERATING, used, p] = (bounds[p, 1, row] if rising else back2) * inverse
        used += kept


def sweep(
    bending: Array,
    pulling: Array,
    j: Array,
    width: float,
    x: Array,
    rates: Array,
    share: Array,
    steepest: float,
    out: Array,
) -> None:
    """One table, out[levels, points], level by level."""
    levels, points = out.shape
    w, tried, before, slope, most, by_j, allowed, nearest, u, along, at = np.empty((11, points))
    for p in range(points):
        w[p], slope[p] = 0.0, steepest
    curvature(pulling, rates[0], w, share[0], steepest, nearest)
    for p in range(points):
        nearest[p] = max(nearest[p], 0.0)
        out[0, p] = sqrt(2.0 * nearest[p])
    for level in range(1, levels):
        rate, step = rates[level], x[level] - x[level - 1]
        fastest(bending, pulling, j, rate, share, steepest * x[level], by_j, most)
        for p in range(points):
            before[p] = w[p]
            w[p] = min(w[p] + slope[p] * step, most[p])
        dr, middle = x[level] ** 2 - x[level - 1] ** 2, 0.5 * (rate + rates[level - 1])
        for _ in range(ROUNDS):
            for p in range(points):
                tried[p] = w[p]
            curvature(pulling, rate, w, share[0], steepest, allowed)
            sum_up(allowed, nearest, u, along)
            go_on(before, u, along, dr, middle / width, at, w)
            keep_passable(most, along, width / max(rate, 1e-9), w)
        for p in range(points):
            w[p] = min(w[p], tried[p])
            nearest[p] = allowed[p]
            slope[p] = (w[p] - before[p]) / step
            out[level, p] = w[p] / x[level]
    for p in range(points):
        out[0, p] = min(out[0, p], out[1, p])


def curvature(pulling: Array, rate: float, w: Array, share: float, steepest: float, out: Array) -> None:
    """u that every row allows at |w|."""
    cube = rate * rate * rate
    for p in range(out.size):
        out[p] = inf
    for row in range(pulling.shape[1]):
        for p in range(out.size):
            u = pulling[ROOM_J, row, p] - pulling[JERKING, row, p] * cube - rate * pulling[TURNING, row, p] * w[p]
            out[p] = u if u < out[p] else out[p]
    for p in range(out.size):
        u = out[p]
        out[p] = min(share * u if u > 0.0 else u / share, steepest * steepest)


def fastest(
    bending: Array, pulling: Array, j: Array, rate: float, share: Array, steepest: float, by_j: Array, out: Array
) -> None:
    """|w| for which every row's acceleration is within its limit, and its jerk with u = 0."""
    square, cube, n = rate * rate, rate * rate * rate, j.size
    for p in range(out.size):
        by_j[p] = out[p] = inf
    for row in range(pulling.shape[1]):
        for p in range(out.size):
            value = pulling[ROOM_A, row, p] - pulling[ACCELERATING, row, p] * square
            out[p] = value if value < out[p] else out[p]
    for row in range(bending.shape[1]):
        limit = j[row % n]
        for p in range(out.size):
            value = (limit - bending[THIRD, row, p] * cube) * bending[PER_TURNING, row, p]
            by_j[p] = value if value < by_j[p] else by_j[p]
    for p in range(out.size):
        most = min(share[1] * out[p], share[2] * (by_j[p] / max(rate, TINY)))
        out[p] = min(max(most, 0.0), steepest)


def sum_up(allowed: Array, nearest: Array, u: Array, along: Array) -> None:
    """u, for less may be left nearer to rest, and its running sums."""
    total = 0.0
    for p in range(u.size):
        u[p] = min(allowed[p], nearest[p])
        along[p] = total
        total += u[p]


def go_on(before: Array, u: Array, along: Array, dr: float, per_cell: float, at: Array, w: Array) -> None:
    """|w| at this level, from what it is at the level before where the path will be then."""
    last = u.size - 1
    for p in range(u.size):
        at[p] = min(p + 2.0 * dr / max(before[p] + w[p], 1e-6) * per_cell, float(last))
    for p in range(u.size):
        i = min(int(at[p]), last - 1)
        part = at[p] - i
        there = before[i] + part * (before[i + 1] - before[i])
        w[p] = there * there
        u[p] = min((along[i] + part * (along[i + 1] - along[i]) - along[p]) / max(at[p] - p, 1e-9), u[p])
    for p in range(u.size):
        w[p] = sqrt(max(w[p] + 2.0 * dr * u[p], 0.0))


def keep_passable(most: Array, along: Array, per_sum: float, w: Array) -> None:
    """No |w| from which a bound further on could not be met any more."""
    least = inf
    for p in range(w.size - 1, -1, -1):
        passed = along[p] * per_sum
        least = min(least, most[p] + passed)
        w[p] = min(w[p], max(least - passed, 0.0))
