"""MASA for many moves at once: the maps of time_optimal.py and inverse.py on arrays."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .checks import DURATION_MAX, DURATION_TOLERANCE, check_batch, check_duration
from .errors import InfeasibleDuration
from .inverse import SIN_MAX, Minimise, shape_map
from .s_curve import SERIES_ORDER, Array, Pulse, mean_jerk

CHUNK = 2048  # moves worked on at a time: the intermediate arrays stay in the cache

ArrayMap = Callable[[Array, Array, Array, Array, Array], tuple[Array, Array, Array]]


def synchronise_batch(
    distances: ArrayLike,
    v_max: ArrayLike,
    a_max: ArrayLike,
    j_max: ArrayLike,
    minimise: Minimise = "acceleration",
    duration: ArrayLike | None = None,
    pulse: Pulse = "constant",
) -> tuple[Array, Array, Array]:
    """MASA for m moves of n axes: distances[m, n], limits[n], any consistent units -> T[m, n, 7], U[m, n, 7], t[m].

    `duration` (one, or [m]) asks for longer moves. Results are those of `synchronise` up to the last bits.
    Raises as synchronise; an error of one move names its axis.
    """
    shape_map(minimise)
    d, v, a, j = check_batch(distances, v_max, a_max, j_max)
    m, n = d.shape
    mean = mean_jerk(j, pulse)
    a = np.minimum(a, np.sqrt(v * mean))  # (23)
    # Axes first: then all that differs between the axes is constant along the inner loops.
    limits = v[:, np.newaxis], a[:, np.newaxis], mean[:, np.newaxis]
    requested = None if duration is None else _requested(duration, m)
    series, inputs, times = np.empty((m, n, 7)), np.zeros((m, n, 7)), np.empty(m)
    for first in range(0, m, CHUNK):
        part = slice(first, first + CHUNK)
        wanted = None if requested is None else requested[part]
        signed = np.ascontiguousarray(d[part].T)
        shape, times[part] = _moves(np.abs(signed), *limits, ARRAY_MAPS[minimise], wanted)
        peak = np.sign(signed) * shape[3] * (1.5 if pulse == "parabolic" else 1.0)  # (14)
        _write(series[part], inputs[part], shape, peak)
    return series, inputs, times


def _write(series: Array, inputs: Array, shape: Sequence[Array], peak: Array) -> None:
    """Fill T and U [c, n, 7] from [n, c], one axis's segment at a time: long copies instead of many short ones."""
    negative = -peak
    for axis in range(peak.shape[0]):
        for k, source in enumerate(SERIES_ORDER):
            series[:, axis, k] = shape[source][axis]
        inputs[:, axis, 0] = inputs[:, axis, 6] = peak[axis]
        inputs[:, axis, 2] = inputs[:, axis, 4] = negative[axis]


def _requested(duration: ArrayLike, m: int) -> Array:
    times = np.asarray(duration, dtype=np.float64)
    if times.shape not in ((), (m,)):
        raise ValueError(f"duration: expected one or {m} values, got shape {times.shape}")
    for t in times[~((times >= 0.0) & (times <= DURATION_MAX))].tolist():
        check_duration(t)
    return np.broadcast_to(times, (m,))


def _moves(
    d: Array, v: Array, a: Array, j: Array, array_map: ArrayMap, requested: Array | None
) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """tj, ta, tv, mean jerk [n, c] and durations [c] of c moves over distances d[n, c] >= 0; limits [n, 1]."""
    own = _shortest(d, v, a, j)
    t = own.max(axis=0)
    if requested is not None:
        _check_feasible(own, t, requested)
        t = np.maximum(t, requested)
    # A move of nothing in no time is critical on all axes; the maps, whose result is then not used, divide by the time.
    times = np.where(t > 0.0, t, 1.0)
    tj, ta, jerk = array_map(times, d, v, a, j)
    tv = np.maximum(times - 2.0 * ta - 4.0 * tj, 0.0)
    critical = np.nonzero(t <= own)
    one_each = own[critical], d[critical], *(limit[critical[0], 0] for limit in (v, a, j))
    tj[critical], ta[critical], tv[critical] = _optimal(*one_each)
    jerk[critical] = one_each[-1]
    return (tj, ta, tv, jerk), t


def _check_feasible(own: Array, t: Array, requested: Array) -> None:
    short = requested < t * (1.0 - DURATION_TOLERANCE)
    if short.any():
        move = int(np.argmax(short))
        raise InfeasibleDuration(float(requested[move]), float(t[move]), int(np.argmax(own[:, move])))


def _shortest(d: Array, v: Array, a: Array, j: Array) -> Array:
    """As time_optimal.shortest."""
    tj = a / j
    t_up = tj + v / a
    out = np.where(d >= v * t_up, t_up + d / v, tj + np.sqrt(tj * tj + 4.0 * d / a))
    low = np.nonzero(d < np.minimum(2.0 * a * tj * tj, v * t_up))  # few as a rule, and cbrt is slow
    out[low] = 4.0 * np.cbrt(d[low] / (2.0 * j[low[0], 0]))
    return out


def _optimal(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As time_optimal.optimal_shape: tj, ta, tv."""
    tj = a / j
    cruising = d >= v * (tj + v / a)
    excess = d / a - 2.0 * tj * tj
    reached = cruising | (excess >= 0.0)
    ta = np.where(cruising, v / a - tj, 2.0 * excess / (np.sqrt(tj * tj + 4.0 * d / a) + 3.0 * tj))
    ta = np.where(reached, np.maximum(ta, 0.0), 0.0)
    tj = np.where(reached, tj, 0.25 * t)
    return tj, ta, np.where(cruising, np.maximum(t - 2.0 * ta - 4.0 * tj, 0.0), 0.0)


def _velocity_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As inverse.velocity_shape: tj, ta, jerk."""
    tj = a / j
    saturated = d >= a * tj * np.maximum(t - 2.0 * tj, 2.0 * tj)
    c = t - tj
    root = np.sqrt(np.maximum(c * c - 4.0 * d / a, tj * tj))
    # c + root > 0 where it is used; elsewhere t may be shorter than a pulse.
    peak = np.minimum(v, 2.0 * d / np.where(saturated, c + root, 1.0))
    ta = np.where(saturated, np.maximum(peak / a - tj, 0.0), 0.0)
    angle = np.arcsin(np.minimum(np.sqrt(27.0 * (d / (j * t))) / t, SIN_MAX)) / 3.0
    tj = np.where(saturated, tj, 2.0 / 3.0 * t * np.sin(angle) * np.sin(angle + np.pi / 3.0))
    return tj, ta, np.broadcast_to(j, d.shape).copy()


def _peaks(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array]:
    """As inverse._peak_velocity."""
    peak = 2.0 * d / t
    free = peak < v
    c = np.where(free, 0.5 * t, np.maximum(t - d / v, a / j + v / a))
    return np.where(free, peak, v), c


def _acceleration_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As inverse.acceleration_shape: tj, ta, jerk."""
    peak, c = _peaks(t, d, v, a, j)
    root = np.sqrt(np.maximum(c * c - 4.0 * peak / j, 0.0))
    lowest = np.minimum(a, 2.0 * peak / (c + root))
    tj = lowest / j
    ta = np.maximum(peak / np.where(d > 0.0, lowest, 1.0) - tj, 0.0)
    ta = np.where(d > 0.0, ta, 0.5 * t)
    return tj, ta, np.broadcast_to(j, d.shape).copy()


def _jerk_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As inverse.jerk_shape: tj, ta, jerk."""
    peak, c = _peaks(t, d, v, a, j)
    gentle = 2.0 * peak <= a * c
    time = peak / a
    tj = np.where(gentle, 0.5 * c, np.maximum(c - time, a / j))
    jerk = np.where(gentle, peak / (tj * tj), a / tj)
    ta = np.where(gentle, 0.0, np.maximum(time - tj, 0.0))
    return tj, ta, np.minimum(jerk, j)


ARRAY_MAPS: dict[str, ArrayMap] = {
    "velocity": _velocity_map,
    "acceleration": _acceleration_map,
    "jerk": _jerk_map,
}
