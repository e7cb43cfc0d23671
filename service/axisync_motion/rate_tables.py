"""How fast the rate of a path clock may change and still come to rest, prepared when planning.

With the rate r = ds/dt and its first two derivatives w and u: v = q' r, a = q'' r^2 + q' w,
j = q''' r^3 + 3 q'' r w + q' u. While the rate falls, w < 0, it can be caught again only if |w| is not too large for
the jerk that is left further along the path, so a table holds over s and r how large |w| may be. Likewise for a rate
that rises towards 1.

From one rate to the next, dr apart, w^2 changes by 2 u dr while s moves on by r dr / |w|. So the tables are swept level
by level, from rest, with the largest u that every axis allows on the way; |w| is bounded at each point by the
acceleration of every axis, and by what can be slowed to before the next point's bound is met.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .backends import kernels
from .closed_forms import Array
from .errors import InvalidLimits
from .path_bounds import cell_bounds
from .rate_loops import ROUNDS, TINY
from .trajectory import Trajectory

LEVELS = 20
STEEPEST = np.array([256.0, 32.0, 32.0])[:, np.newaxis]
"""1/s, for stop, fall and rise: largest |w| over the root of the rate's way to go. Where the axes hardly move nothing
else bounds it; an override need not take effect within milliseconds."""
UNIT = STEEPEST / 65535.0
"""1/s: of the tables' codes."""
NOT_WORTH = np.array([0.0, 0.01, 0.01])[:, np.newaxis, np.newaxis]
"""1/s: so little is left out, where a move uses all of its limits and its rate can hardly be changed."""
CELLS_PER_STOP = 48
LEAST_CELLS, MOST_CELLS = 64, 500
ROUNDING = 1e-9  # by which a path that goes as fast as it may can exceed its own limit

# Of what is possible in stop, fall and rise: the rest makes up for what tables made of samples do not see, so that the
# cycle can keep to them. Within the limits of moves little is left near rate 1, and a stop needs no such haste.
SHARE_U = np.array([0.96, 0.6, 0.4])[:, np.newaxis]
SHARE_A = np.array([0.99, 0.95, 0.95])[:, np.newaxis]
SHARE_J = np.array([0.99, 0.7, 0.4])[:, np.newaxis]

X = np.linspace(0.0, 1.0, LEVELS + 1)
"""Levels: the root of the rate's way to go; near the end of a change w is in proportion to it."""
RATES = np.array([X * X, X * X, 1.0 - X * X])
"""[3, LEVELS + 1] of stop, fall and rise."""


@dataclass(frozen=True, slots=True, eq=False)
class RateTables:
    """What a path clock needs beside the trajectory.

    Attributes:
        codes: uint16 [3, LEVELS + 1, points] of |w| / x, in units of UNIT, over equal steps of s from 0 to
            the duration, and of x from 0 to 1. To rest within the stop limits, x^2 = r; to rest within the limits,
            x^2 = r; to rate 1 within the limits, x^2 = 1 - r.
        limits: [4, n] acceleration and jerk of moves, then of stops.
    """

    codes: NDArray[np.uint16]
    limits: Array


class Table:
    """Looks up one of the tables: how large |w| may be."""

    def __init__(self, codes: NDArray[np.uint16], unit: float, duration: float, steepest: float) -> None:
        """`codes` [LEVELS + 1, points] of `unit`; `steepest` is the most that |w| / x may be, 1/s."""
        self._points = codes.shape[1]
        self._codes = memoryview(codes.tobytes()).cast("H")
        self._per_s = (self._points - 1) / duration if duration > 0.0 else 0.0
        self._last = self._points - 2
        self._unit, self._steepest = unit, steepest

    def at(self, s: float, way: float) -> float:
        """1/s, at s with `way` of the rate to go, 0 to 1: linear between the points."""
        x = sqrt(way)
        column, row = s * self._per_s, x * LEVELS
        i, k = min(int(column), self._last), min(int(row), LEVELS - 1)
        f = min(column - i, 1.0)
        codes, first = self._codes, k * self._points + i
        second = first + self._points
        low: float = codes[first] + f * (codes[first + 1] - codes[first])
        high: float = codes[second] + f * (codes[second + 1] - codes[second])
        return x * min((low + (row - k) * (high - low)) * self._unit, self._steepest)


def rate_tables(
    trajectory: Trajectory,
    v_max: ArrayLike,
    a_max: ArrayLike,
    j_max: ArrayLike,
    a_stop: ArrayLike,
    j_stop: ArrayLike,
    cells: int | None = None,
) -> RateTables:
    """Tables for limits [n] of moves and of stops; `cells` of s, by default a 48th of the quickest axis's stop each.

    The path's own acceleration and jerk must be below the stop limits, and its velocity within v_max, which a rate
    below 1 cannot exceed: InvalidLimits otherwise. Limits of moves below the path's own count as that.
    """
    n, duration = trajectory.start.size, trajectory.duration
    names = ("v_max", "a_max", "j_max", "a_stop", "j_stop")
    given = (v_max, a_max, j_max, a_stop, j_stop)
    v, a, j, a2, j2 = (_vector(name, limit, n) for name, limit in zip(names, given, strict=True))
    if duration == 0.0:
        return RateTables(np.zeros((3, LEVELS + 1, 2), dtype=np.uint16), np.array([a, j, a2, j2]))
    if cells is None:
        cell = float(np.min(v / a2 + a2 / j2)) / CELLS_PER_STOP
        cells = int(np.clip(np.ceil(duration / cell), LEAST_CELLS, MOST_CELLS))
    own = _peaks(trajectory, cells)
    _check_above("v_max", v * (1.0 + ROUNDING), own[0])
    _check_above("a_stop", a2, own[1])
    _check_above("j_stop", j2, own[2])
    a, j = np.maximum(a, own[1]), np.maximum(j, own[2])
    found = _slopes(cell_bounds(trajectory, cells), np.array([a2, a, a]), np.array([j2, j, j]), duration / cells)
    slopes = np.maximum(found - NOT_WORTH, 0.0)
    codes = np.minimum(slopes / UNIT[..., np.newaxis], 65535.0).astype(np.uint16)
    return RateTables(codes, np.array([a, j, a2, j2]))


def _vector(name: str, limit: ArrayLike, n: int) -> Array:
    values = np.array(limit, dtype=np.float64)
    if values.shape != (n,):
        raise ValueError(f"{name}: expected {n} values, got shape {values.shape}")
    return values


def _peaks(trajectory: Trajectory, cells: int) -> Array:
    """[3, n] the path's largest velocity, acceleration and jerk, at its knots and at the points of the tables."""
    points = np.union1d(np.linspace(0.0, trajectory.duration, cells + 1), trajectory.knots)
    peaks: Array = np.abs(trajectory.sample(points)[1:]).max(axis=1)
    return peaks


def _check_above(name: str, limit: Array, own: Array) -> None:
    wrong = ~(own < limit)
    if wrong.any():
        axis = int(np.argmax(wrong))
        raise InvalidLimits(name, float(limit[axis]), f"above the path's own {float(own[axis])!r}", axis)


def _slopes(bounds: Array, a: Array, j: Array, width: float) -> Array:
    """[3, LEVELS + 1, points] |w| / x; arguments as of _Sweep."""
    compiled = kernels()
    if compiled is None:
        return _Sweep(bounds, a, j, width).run()
    out = np.empty((3, LEVELS + 1, bounds.shape[0]))
    shares = np.concatenate([SHARE_U, SHARE_A, SHARE_J], axis=1)
    compiled.rate_slopes(bounds, a, j, width, X, RATES, shares, STEEPEST[:, 0].copy(), out)
    return out


class _Sweep:
    """The three tables at once: arrays [3, points], and [3, rows, points] with a row for each way an axis moves.

    A row stands for an axis's derivatives times 1 or -1, so that only their upper bounds are needed. Those of an axis
    that never moves that way do not bound u, and are left out of what is divided by q'.
    """

    def __init__(self, bounds: Array, a: Array, j: Array, width: float) -> None:
        """`bounds` as of cell_bounds; a, j [3, n]; `width` of a cell."""
        q1, q2, q3 = np.ascontiguousarray(bounds.transpose(1, 2, 0))
        back2, back3 = _negated(q2), _negated(q3)
        a, j = (np.tile(limit, 2)[..., np.newaxis] for limit in (a, j))
        self._jerk, self._third = j, np.array([q3, q3, back3])
        self._per_turning = 1.0 / np.maximum(3.0 * back2, TINY)
        moves = (q1 > 0.0).any(axis=1)
        inverse = 1.0 / np.maximum(q1[moves], TINY)
        self._accelerating = np.array([back2, back2, q2])[:, moves] * inverse
        self._jerking = self._third[:, moves] * inverse
        self._turning = 3.0 * back2[moves] * inverse
        self._room_a, self._room_j = a[:, moves] * inverse, j[:, moves] * inverse
        points = q1.shape[1]
        self._width, self._index = width, np.arange(points, dtype=np.float64)
        self._left = self._index[-1] - self._index
        self._begins = points * np.arange(3)[:, np.newaxis]

    def run(self) -> Array:
        """[3, LEVELS + 1, points] |w| / x."""
        w = np.zeros((3, self._index.size))
        slope = w + STEEPEST
        nearest = np.maximum(self._curvature(self._room(0), self._turning, w), 0.0)
        out = np.empty((3, LEVELS + 1, w.shape[1]))
        out[:, 0] = np.sqrt(2.0 * nearest)
        for level in range(1, LEVELS + 1):
            guess = w + slope * (X[level] - X[level - 1])
            after, nearest = self._level(level, w, guess, nearest)
            slope = (after - w) / (X[level] - X[level - 1])
            out[:, level], w = after / X[level], after
        out[:, 0] = np.minimum(out[:, 0], out[:, 1])
        return out

    def _level(self, level: int, before: Array, guess: Array, nearest: Array) -> tuple[Array, Array]:
        """|w| at a level from that at the level before, and the u that every row allows there."""
        rate, width = RATES[:, level, np.newaxis], self._width
        dr = float(X[level] ** 2 - X[level - 1] ** 2)
        middle = 0.5 * (rate + RATES[:, level - 1, np.newaxis])
        room, turning = self._room(level), rate[..., np.newaxis] * self._turning
        most = self._most(level)
        w, allowed = np.minimum(guess, most), nearest
        for _ in range(ROUNDS):
            tried = w
            cells = 2.0 * dr / np.maximum(before + w, 1e-6) * (middle / width)
            allowed = self._curvature(room, turning, w)
            u = np.minimum(allowed, nearest)  # less may be left nearer to rest
            along = np.zeros_like(u)
            np.cumsum(u[:, :-1], axis=1, out=along[:, 1:])
            index, part = self._ahead(cells)
            there = _between(before, index, part)
            mean = (_between(along, index, part) - along) / np.maximum(np.minimum(cells, self._left), 1e-9)
            mean = np.minimum(mean, u)
            w = np.sqrt(np.maximum(there * there + 2.0 * dr * mean, 0.0))
            passed = along * (width / np.maximum(rate, 1e-9))
            passable = np.minimum.accumulate((most + passed)[:, ::-1], axis=1)[:, ::-1] - passed
            w = np.minimum(w, np.maximum(passable, 0.0))
        # A smaller |w| comes to the level before further along the path, where more may be possible: in turns, so that
        # the rounds do not meet. Then the smaller of them holds.
        return np.minimum(w, tried), allowed

    def _room(self, level: int) -> Array:
        """u that each row leaves at w = 0."""
        return _less(self._room_j, self._jerking * RATES[:, level, np.newaxis, np.newaxis] ** 3)

    def _most(self, level: int) -> Array:
        """|w| for which every row's acceleration is within its limit, and its jerk with u = 0."""
        rates = RATES[:, level, np.newaxis, np.newaxis]
        by_a = _less(self._room_a, self._accelerating * rates**2).min(axis=1, initial=np.inf)
        left = _less(self._jerk, self._third * rates**3)
        left *= self._per_turning
        by_j = left.min(axis=1, initial=np.inf) / np.maximum(rates[:, 0], TINY)
        most: Array = np.clip(np.minimum(SHARE_A * by_a, SHARE_J * by_j), 0.0, STEEPEST * X[level])
        return most

    def _curvature(self, room: Array, turning: Array, w: Array) -> Array:
        """u that every row allows at |w|."""
        u = _less(room, turning * w[:, np.newaxis]).min(axis=1, initial=np.inf)
        kept: Array = np.minimum(np.where(u > 0.0, SHARE_U * u, u / SHARE_U), STEEPEST**2)
        return kept

    def _ahead(self, cells: Array) -> tuple[NDArray[np.intp], Array]:
        """Where in flattened [3, points] it is so many cells further along the path: before it, and the part beyond."""
        at = np.minimum(self._index + cells, self._index[-1])
        before = np.minimum(at.astype(np.intp), self._index.size - 2)
        at -= before
        before += self._begins
        return before, at


def _less(limit: Array, used: Array) -> Array:
    """What is left of a limit, in the place of what is used: no more memory than is needed passes the cache."""
    left: Array = np.subtract(limit, used, out=used)
    return left


def _between(values: Array, index: NDArray[np.intp], part: Array) -> Array:
    """Values [3, points] part of the way from one point, an index of them flattened, to the next."""
    low: Array = values.take(index)
    return low + part * (values.take(index + 1) - low)


def _negated(bounds: Array) -> Array:
    """Bounds of the negatives of what `bounds` [2n, points] bound."""
    half = bounds.shape[0] // 2
    return np.concatenate([bounds[half:], bounds[:half]])
