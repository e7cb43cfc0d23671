"""MASA for many moves at once: the maps of closed_forms.py compiled, or else written for arrays."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .backends import Kernels, kernels
from .checks import check_batch, check_batch_shapes, check_duration
from .closed_forms import ANY_DURATION, DURATION_MAX, DURATION_TOLERANCE, SIN_MAX, Array
from .errors import InfeasibleDuration
from .inverse import MINIMISE_CODES, Minimise, shape_map
from .s_curve import PARABOLIC, SERIES_ORDER, Pulse, mean_jerk

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
    mean_jerk(1.0, pulse)
    d, *limits = check_batch_shapes(distances, v_max, a_max, j_max)
    requested = None if duration is None else _requested(duration, len(d))
    compiled = kernels()
    if compiled is not None and d.size > 0:
        moves = _compiled(compiled, d, np.array(limits), minimise, requested, pulse)
        if moves is not None:
            return moves
    # Also where something is to be refused: this finds what, and says so.
    return _numpy(d, limits, minimise, requested, pulse)


def _compiled(
    compiled: Kernels, d: Array, limits: Array, minimise: Minimise, requested: Array | None, pulse: Pulse
) -> tuple[Array, Array, Array] | None:
    """The moves, or None if any is to be refused."""
    m, n = d.shape
    asked = np.full(m, ANY_DURATION) if requested is None else requested.copy()
    series, inputs, own, times = np.empty((m, n, 7)), np.empty((m, n, 7)), np.empty(n), np.empty(m)
    plain = np.require(d, requirements=["C", "A", "W"])
    done = compiled.plan_batch(
        plain, limits, MINIMISE_CODES[minimise], asked, PARABOLIC[pulse], series, inputs, own, times
    )
    return (series, inputs, times) if done else None


def _numpy(
    d: Array, limits: list[Array], minimise: Minimise, requested: Array | None, pulse: Pulse
) -> tuple[Array, Array, Array]:
    check_batch(d, *limits)
    v, a, j = limits
    m, n = d.shape
    mean = mean_jerk(j, pulse)
    a = np.minimum(a, np.sqrt(v * mean))  # (23)
    # Axes first: then all that differs between the axes is constant along the inner loops.
    columns = v[:, np.newaxis], a[:, np.newaxis], mean[:, np.newaxis]
    series, inputs, times = np.empty((m, n, 7)), np.zeros((m, n, 7)), np.empty(m)
    for first in range(0, m, CHUNK):
        part = slice(first, first + CHUNK)
        wanted = None if requested is None else requested[part]
        signed = np.ascontiguousarray(d[part].T)
        shape, times[part] = _moves(np.abs(signed), *columns, ARRAY_MAPS[minimise], wanted)
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
    """As closed_forms.shortest."""
    tj = a / j
    t_up = tj + v / a
    out = np.where(d >= v * t_up, t_up + d / v, tj + np.sqrt(tj * tj + 4.0 * d / a))
    low = np.nonzero(d < np.minimum(2.0 * a * tj * tj, v * t_up))  # few as a rule, and cbrt is slow
    out[low] = 4.0 * np.cbrt(d[low] / (2.0 * j[low[0], 0]))
    return out


def _optimal(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As closed_forms.optimal_shape: tj, ta, tv."""
    tj = a / j
    cruising = d >= v * (tj + v / a)
    excess = d / a - 2.0 * tj * tj
    reached = cruising | (excess >= 0.0)
    ta = np.where(cruising, v / a - tj, 2.0 * excess / (np.sqrt(tj * tj + 4.0 * d / a) + 3.0 * tj))
    ta = np.where(reached, np.maximum(ta, 0.0), 0.0)
    tj = np.where(reached, tj, 0.25 * t)
    return tj, ta, np.where(cruising, np.maximum(t - 2.0 * ta - 4.0 * tj, 0.0), 0.0)


def _velocity_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As closed_forms.velocity_shape: tj, ta, jerk."""
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
    """As closed_forms.peak_velocity."""
    peak = 2.0 * d / t
    free = peak < v
    c = np.where(free, 0.5 * t, np.maximum(t - d / v, a / j + v / a))
    return np.where(free, peak, v), c


def _acceleration_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As closed_forms.acceleration_shape: tj, ta, jerk."""
    peak, c = _peaks(t, d, v, a, j)
    root = np.sqrt(np.maximum(c * c - 4.0 * peak / j, 0.0))
    lowest = np.minimum(a, 2.0 * peak / (c + root))
    tj = lowest / j
    ta = np.maximum(peak / np.where(d > 0.0, lowest, 1.0) - tj, 0.0)
    ta = np.where(d > 0.0, ta, 0.5 * t)
    return tj, ta, np.broadcast_to(j, d.shape).copy()


def _jerk_map(t: Array, d: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """As closed_forms.jerk_shape: tj, ta, jerk."""
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
