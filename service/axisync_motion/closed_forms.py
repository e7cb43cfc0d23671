"""The closed forms of MASA on floats: f (36), F (33), the three inverse maps, and whole moves of them.

Stable forms of the paper's equations: the printed roots cancel, these do not. d >= 0 is a distance, t a duration, v,
a, j are limits, `a` already capped by (23) and j the mean jerk of a pulse.

numba compiles this file as it stands (compiled.py): the same operations in the same order, so the same results. What
it compiles must all be in here, constants too, since its cache is valid while one file is unchanged.
"""

from math import asin, cbrt, pi, sin, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Vector: TypeAlias = list[float] | Array
Shape: TypeAlias = tuple[float, float, float, float]
"""tj, ta, tv and the mean jerk of a pulse (positive)."""

# Within these bounds no closed form can leave the normal range of float64. They are far outside of what any unit
# system gives a machine.
LIMIT_MIN, LIMIT_MAX = 1e-40, 1e40
DISTANCE_MIN, DISTANCE_MAX = 1e-60, 1e60
DURATION_MAX = 1e75

# A duration this little below the shortest one is the shortest one, written down and read again.
DURATION_TOLERANCE = 1e-12

VELOCITY, ACCELERATION, JERK = 0, 1, 2  # what a map makes lowest
ANY_DURATION = -1.0  # in place of a duration asked for
REFUSED = -1.0  # in place of a duration

SIN_MAX = sqrt(27.0 / 32.0)


def capped_acceleration(v: float, a: float, j: float) -> float:
    """Eq. (23): the acceleration that jerk j can reach and leave again on the way to v. Must come first."""
    cap = sqrt(v * j)
    return cap if cap < a else a


def shortest(d: float, v: float, a: float, j: float) -> float:
    """f, eq. (36) corrected: the shortest duration."""
    tj = a / j
    t_up = tj + v / a
    if d >= v * t_up:
        return t_up + d / v
    if d >= 2.0 * a * tj * tj:
        return tj + sqrt(tj * tj + 4.0 * d / a)
    return 4.0 * cbrt(d / (2.0 * j))


def optimal_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """F, eqs. (21), (29) and (32), for t = shortest(d, v, a, j)."""
    tj = a / j
    if d >= v * (tj + v / a):
        ta = v / a - tj
        if ta < 0.0:  # by rounding, when (23) binds
            ta = 0.0
        tv = t - 2.0 * ta - 4.0 * tj
        return tj, ta, tv if tv > 0.0 else 0.0, j
    excess = d / a - 2.0 * tj * tj
    if excess >= 0.0:
        return tj, 2.0 * excess / (sqrt(tj * tj + 4.0 * d / a) + 3.0 * tj), 0.0, j
    return t / 4.0, 0.0, 0.0, j


def velocity_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """f_V^-1: the smaller root of (50) if (46) as corrected says so, else the middle root of (53) as corrected."""
    tj = a / j
    ta = 0.0
    if d > 0.0 and d >= a * tj * max(t - 2.0 * tj, 2.0 * tj):
        c = t - tj
        ta = min(v, 2.0 * d / (c + sqrt(max(c * c - 4.0 * d / a, tj * tj)))) / a - tj
        if ta < 0.0:
            ta = 0.0
    else:
        angle = asin(min(sqrt(27.0 * (d / (j * t))) / t, SIN_MAX)) / 3.0
        tj = 2.0 / 3.0 * t * sin(angle) * sin(angle + pi / 3.0)
    tv = t - 2.0 * ta - 4.0 * tj
    return tj, ta, tv if tv > 0.0 else 0.0, j


def peak_velocity(t: float, d: float, v: float, a: float, j: float) -> tuple[float, float]:
    """Peak velocity of f_A^-1 and f_J^-1, and the time c that they rise: t/2 unless V binds."""
    peak = 2.0 * d / t
    if peak < v:
        return peak, 0.5 * t
    return v, max(t - d / v, a / j + v / a)


def acceleration_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """f_A^-1: the smaller root of (60) or (63)."""
    if d == 0.0:
        return 0.0, 0.5 * t, 0.0, j
    peak, c = peak_velocity(t, d, v, a, j)
    lowest = min(a, 2.0 * peak / (c + sqrt(max(c * c - 4.0 * peak / j, 0.0))))
    tj = lowest / j
    ta = peak / lowest - tj
    if ta < 0.0:
        ta = 0.0
    tv = t - 2.0 * ta - 4.0 * tj
    return tj, ta, tv if tv > 0.0 else 0.0, j


def jerk_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """f_J^-1: acceleration saturated, (70) or (79), if two jerk pulses alone would exceed it; else (75) or (77)."""
    peak, c = peak_velocity(t, d, v, a, j)
    ta = 0.0
    if 2.0 * peak <= a * c:
        tj = 0.5 * c
        lowest = peak / (tj * tj)
    else:
        tj = max(c - peak / a, a / j)  # cancels when the pulse is short, and must not then exceed j
        lowest = a / tj
        ta = peak / a - tj
        if ta < 0.0:
            ta = 0.0
    tv = t - 2.0 * ta - 4.0 * tj
    return tj, ta, tv if tv > 0.0 else 0.0, min(lowest, j)


def shape(minimise: int, t: float, own: float, d: float, v: float, a: float, j: float) -> Shape:
    """One axis of a move of duration t, where it needs `own` at least: F if it is critical, the inverse map if not."""
    if t <= own:
        return optimal_shape(t, d, v, a, j)
    if minimise == ACCELERATION:
        return acceleration_shape(t, d, v, a, j)
    if minimise == JERK:
        return jerk_shape(t, d, v, a, j)
    return velocity_shape(t, d, v, a, j)


def signed_peak(mean: float, distance: float, parabolic: bool) -> float:
    """Peak jerk of a pulse of this mean, with the sign of the distance: (14), and 0 for no distance, as (85)."""
    if distance == 0.0:
        return 0.0
    peak = 1.5 * mean if parabolic else mean
    return peak if distance > 0.0 else -peak


def prepare(v: Vector, a: Vector, j: Vector, parabolic: bool) -> bool:
    """Cap a by (23) and make j the mean of its pulse, in place; False if a limit is to be refused."""
    for i in range(len(v)):
        vi, ai, ji = v[i], a[i], j[i]
        if not (LIMIT_MIN <= vi <= LIMIT_MAX and LIMIT_MIN <= ai <= LIMIT_MAX and LIMIT_MIN <= ji <= LIMIT_MAX):
            return False
        if parabolic:
            ji = ji * 2.0 / 3.0
            j[i] = ji
        a[i] = capped_acceleration(vi, ai, ji)
    return True


def plan_batch(
    d: Array, limits: Array, minimise: int, requested: Array, parabolic: bool,
    series: Array, inputs: Array, own: Array, times: Array,
) -> bool:  # fmt: skip
    """MASA for moves over d[m, n] in requested[m] or ANY_DURATION: fills series and inputs [m, n, 7] and times[m].

    limits[3, n] are overwritten, requested and times may be one array, own[n] holds the shortest durations of the last
    move's axes. False, and no result, if anything is to be refused. Fast when compiled only; and then without views
    of rows, since to count references to those takes as long as the rest.
    """
    if not prepare(limits[0], limits[1], limits[2], parabolic):
        return False
    for k in range(d.shape[0]):
        t = 0.0
        for i in range(d.shape[1]):
            x = abs(d[k, i])
            if not (DISTANCE_MIN <= x <= DISTANCE_MAX or x == 0.0):
                return False
            least = shortest(x, limits[0, i], limits[1, i], limits[2, i])
            own[i] = least
            t = max(t, least)
        asked = requested[k]
        if t > DURATION_MAX or (asked != ANY_DURATION and asked < t * (1.0 - DURATION_TOLERANCE)):
            return False
        t = max(t, asked)
        for i in range(d.shape[1]):
            found = shape(minimise, t, own[i], abs(d[k, i]), limits[0, i], limits[1, i], limits[2, i])
            tj, ta, tv, mean = found
            peak = signed_peak(mean, d[k, i], parabolic)
            series[k, i, 0] = series[k, i, 2] = series[k, i, 4] = series[k, i, 6] = tj
            series[k, i, 1] = series[k, i, 5] = ta
            series[k, i, 3] = tv
            inputs[k, i, 0] = inputs[k, i, 6] = peak
            inputs[k, i, 2] = inputs[k, i, 4] = -peak
            inputs[k, i, 1] = inputs[k, i, 3] = inputs[k, i, 5] = 0.0
        times[k] = t
    return True


def plan_move(table: Array, minimise: int, requested: float, parabolic: bool, series: Array, inputs: Array) -> float:
    """One move of n axes: rows 0 to 3 of table[6, n] are v, a, j and d; row 4 becomes the axes' own shortest durations.

    Fills series and inputs [n, 7] and returns the duration, or REFUSED. Rows 1 and 2 are overwritten, and 5.
    """
    time = table[5]
    time[0] = requested
    one = 1, series.shape[0], 7
    if plan_batch(
        table[3:4], table[0:3], minimise, time, parabolic, series.reshape(one), inputs.reshape(one), table[4], time
    ):
        return float(time[0])
    return REFUSED
