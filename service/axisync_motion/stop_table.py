"""How long a stop on the path must take, prepared when planning, for a stop that begins anywhere.

Bounds, not samples: for each cell of beginnings the stop is cut into bins of its own time, and in every bin the
acceleration and jerk of each axis are bounded by interval arithmetic over the part of the path that a stop from
anywhere in the cell can then be on. A duration found this way holds for every beginning in the cell.
"""

from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from .backends import kernels
from .closed_forms import Array
from .errors import InvalidLimits
from .path_bounds import PathBounds, cell_bounds
from .stop_loops import GOOD, PATH, R2, R3, ROUNDS, RP, SLACK, P, W
from .trajectory import Trajectory

BINS = 20  # even: the second derivative of the rate changes sign between two bins
FINE = 2  # cells of path bounds per cell of beginnings
CHUNK = 24  # cells worked on at a time
ROUNDING = 1e-9  # by which a path that goes as fast as it may can exceed its own limit

RATE = Polynomial([1.0, 0.0, -3.0, 2.0])
"""The rate over x = t/D; its integral is the path covered, over D."""


@dataclass(frozen=True, slots=True, eq=False)
class StopTable:
    """Duration of a stop that begins at a path parameter in [s[i], s[i+1]): `stop_duration`[i], arrays [k]."""

    s: Array
    stop_duration: Array

    def at(self, s: float) -> float:
        """Duration of a stop beginning at s."""
        index = bisect_right(self.s, s) - 1
        return float(self.stop_duration[max(index, 0)])


def stop_table(
    trajectory: Trajectory, v_max: ArrayLike, a_stop: ArrayLike, j_stop: ArrayLike, points: int | None = None
) -> StopTable:
    """Stops by the rate curve 1 - 3x^2 + 2x^3 that keep |a| <= a_stop[n], |j| <= j_stop[n], |v| <= v_max[n].

    `points` is the number of cells (default: 25 ms each, at most 1000). The path's own acceleration and jerk must be
    below the stop limits, and its velocity within v_max, which slowing then cannot exceed: InvalidLimits otherwise.
    """
    n, duration = trajectory.start.size, trajectory.duration
    v, a, j = _vector("v_max", v_max, n), _vector("a_stop", a_stop, n), _vector("j_stop", j_stop, n)
    if duration == 0.0:
        return StopTable(np.zeros(1), np.zeros(1))
    count = points if points is not None else int(np.clip(np.ceil(duration / 0.025), 16, 1000))
    cells = cell_bounds(trajectory, FINE * count)
    edges = np.linspace(0.0, duration, count + 1)
    q1, q2, q3 = cells.max(axis=0)
    fast = v * (1.0 + ROUNDING)
    if (np.maximum(q1[:n], q1[n:]) >= fast).any():  # the bound is a little above the peaks of a parabola: look there
        speed = np.abs(trajectory.sample(np.concatenate([edges, trajectory.knots]))[1]).max(axis=0)
        _check_above("v_max", fast, speed)
    _check_above("a_stop", a, np.maximum(q2[:n], q2[n:]))
    _check_above("j_stop", j, np.maximum(q3[:n], q3[n:]))
    return StopTable(edges, np.append(_durations(cells, edges, a, j), 0.0))


def _durations(cells: Array, edges: Array, a: Array, j: Array) -> Array:
    """The shortest duration found for a stop that begins in each cell of `edges`."""
    width = float(edges[-1]) / (len(cells) - 1)
    compiled = kernels()
    if compiled is None:
        return _search(PathBounds(cells, width), edges, np.concatenate([a, a]), np.concatenate([j, j]))
    found = np.empty(edges.size - 1)
    compiled.stop_durations(cells.reshape(len(cells), -1), width, edges, a, j, _bins()[..., 0], found)
    return found


def _vector(name: str, limit: ArrayLike, n: int) -> Array:
    values = np.array(limit, dtype=np.float64)
    if values.shape != (n,):
        raise ValueError(f"{name}: expected {n} values, got shape {values.shape}")
    return values


def _check_above(name: str, limit: Array, own: Array) -> None:
    wrong = ~(own < limit)
    if wrong.any():
        axis = int(np.argmax(wrong))
        raise InvalidLimits(name, float(limit[axis]), f"above the path's own {float(own[axis])!r}", axis)


@lru_cache(maxsize=1)
def _bins() -> Array:
    """Lowest and highest value of the rate curve's terms in each bin of x: [6, 2, BINS, 1], rows as in stop_loops."""
    steep = -RATE.deriv()
    terms = {PATH: RATE.integ(), R2: RATE**2, R3: RATE**3, P: steep, RP: RATE * steep, W: RATE.deriv(2)}
    edges = np.linspace(0.0, 1.0, BINS + 1)
    return np.array([_ranges(terms[row], edges) for row in sorted(terms)])[..., np.newaxis]


def _ranges(term: Polynomial, edges: Array) -> Array:
    roots = term.deriv().roots()
    turns = roots.real[np.abs(roots.imag) < 1e-9]
    out = np.empty((2, edges.size - 1))
    for i, (low, high) in enumerate(pairwise(edges.tolist())):
        inside = turns[(turns > low) & (turns < high)]
        values = term(np.concatenate([[low, high], inside]))
        out[:, i] = values.min(), values.max()
    return out


def _most(bound: Array, term: Array) -> Array:
    """The largest product of a quantity below `bound` with a term in [low, high], low >= 0."""
    out: Array = np.maximum(bound * term[0], bound * term[1])
    return out


def _load(bounds: PathBounds, low: Array, high: Array, d: Array, a: Array, j: Array) -> Array:
    """How much of its room a stop of duration d[c] takes at worst if begun in [low[c], high[c]].

    At most 1: it keeps the limits. The room is what the path itself leaves of a limit; the jerk's share is its square
    root, since slowing's jerk mostly goes with 1/d^2 where its acceleration goes with 1/d.
    """
    bins = _bins()
    path = bins[PATH][:, :, 0]
    d = d[:, np.newaxis]
    q1, q2, q3 = bounds.over(low[:, np.newaxis] + d * path[0], high[:, np.newaxis] + d * path[1])
    d = d[:, :, np.newaxis]
    n1, n2 = _negated(q1), _negated(q2)
    room_a = a - _most(q2, bins[R2])
    room_j = j - _most(q3, bins[R3])
    slowing_a = _most(n1, bins[P]) / d
    half = BINS // 2
    bend = np.empty_like(q1)  # the rate's second derivative is negative first, then positive
    bend[:, :half] = _most(n1[:, :half], -bins[W][::-1, :half])
    bend[:, half:] = _most(q1[:, half:], bins[W][:, half:])
    slowing_j = (3.0 * _most(n2, bins[RP]) + bend / d) / d
    share_a = (slowing_a / room_a).max(axis=(1, 2))
    share_j = (slowing_j / room_j).max(axis=(1, 2))
    share: Array = np.maximum(share_a, np.sqrt(np.maximum(share_j, 0.0)))
    return share


def _negated(bound: Array) -> Array:
    """Bounds of the negatives of what `bound` [..., 2n] bounds."""
    n = bound.shape[-1] // 2
    return np.concatenate([bound[..., n:], bound[..., :n]], axis=-1)


def _loads(bounds: PathBounds, low: Array, high: Array, d: Array, a: Array, j: Array) -> Array:
    """As `_load`, a few cells at a time: twice as fast while the intermediate arrays stay in the cache."""
    cells = [slice(p, p + CHUNK) for p in range(0, d.size, CHUNK)]
    return np.concatenate([_load(bounds, low[c], high[c], d[c], a, j) for c in cells])


def _search(bounds: PathBounds, edges: Array, a: Array, j: Array) -> Array:
    """The shortest duration found for each cell of beginnings."""
    low, high = edges[:-1], edges[1:]
    shortest = 0.5 * edges[1]
    d = np.maximum(_guess(bounds, low, high, a, j), shortest)
    best = np.full(low.size, np.inf)
    active = np.arange(low.size)
    rounds = 0
    while active.size:
        tried = d[active]
        share = SLACK * _loads(bounds, low[active], high[active], tried, a, j)
        fits = share <= 1.0
        best[active[fits]] = np.minimum(best[active[fits]], tried[fits])
        d[active] = np.maximum(tried * np.clip(1.01 * share, 0.25, 4.0), shortest)
        rounds += 1
        better = (share < GOOD) & (tried > shortest) & (rounds < ROUNDS)
        active = active[better | ~np.isfinite(best[active])]
    return best


def _guess(bounds: PathBounds, low: Array, high: Array, a: Array, j: Array) -> Array:
    """What a stop needs at its beginning; more, where the path goes on to accelerate or jerk harder."""
    q1, q2, q3 = bounds.over(low, high)
    n1 = _negated(q1)
    needs = np.maximum(1.5 * n1 / (a - q2), np.sqrt(np.maximum(6.0 * n1 / (j - q3), 0.0)))
    worst: Array = needs.max(axis=1)
    return worst
