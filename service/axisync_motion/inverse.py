"""The inverse maps: the gentlest motion of one axis that takes a given time. f_V^-1, f_A^-1 and f_J^-1.

Stable forms of eqs. (51), (54), (61), (64), (70)-(79): the printed roots cancel, these do not. Every map takes
(t, d, v, a, j) with t > f, d >= 0 and `a` capped by (23), and returns (tj, ta, tv, j). The cruise is what is left
of t, so that the axes of a move last equally long to the last bits.
"""

from collections.abc import Callable
from math import asin, pi, sin, sqrt
from typing import Literal

from .checks import DURATION_TOLERANCE, check_axis, check_duration
from .errors import InfeasibleDuration
from .s_curve import Profile, Pulse, Shape, capped_acceleration, make_profile, mean_jerk
from .time_optimal import optimal_shape, shortest

Minimise = Literal["acceleration", "velocity", "jerk"]
ShapeMap = Callable[[float, float, float, float, float], Shape]

SIN_MAX = sqrt(27.0 / 32.0)


def lowest_velocity(
    t: float, distance: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant"
) -> Profile:
    """f_V^-1, eqs. (51), (54), (56): the motion over a signed distance in time t with the lowest peak velocity.

    Raises InvalidLimits, and InfeasibleDuration if t is shorter than f (by more than 1e-12 relative).
    """
    return _lowest(velocity_shape, t, distance, v_max, a_max, j_max, pulse)


def lowest_acceleration(
    t: float, distance: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant"
) -> Profile:
    """f_A^-1, eqs. (61), (64) corrected and (65): the motion in time t with the lowest peak acceleration.

    Raises as lowest_velocity.
    """
    return _lowest(acceleration_shape, t, distance, v_max, a_max, j_max, pulse)


def lowest_jerk(
    t: float, distance: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant"
) -> Profile:
    """f_J^-1, eqs. (71)-(80) with the corrected (68): the motion in time t with the lowest peak jerk.

    Raises as lowest_velocity.
    """
    return _lowest(jerk_shape, t, distance, v_max, a_max, j_max, pulse)


def _lowest(
    shape_map: ShapeMap, t: float, distance: float, v: float, a_max: float, j_max: float, pulse: Pulse
) -> Profile:
    check_axis(distance, v, a_max, j_max)
    check_duration(t)
    d, j = abs(distance), mean_jerk(j_max, pulse)
    a = capped_acceleration(v, a_max, j)
    t_min = shortest(d, v, a, j)
    if t < t_min * (1.0 - DURATION_TOLERANCE):
        raise InfeasibleDuration(t, t_min)
    if t <= t_min:  # the critical axis itself, whose limits leave no choice
        return make_profile(optimal_shape(t_min, d, v, a, j), distance, t_min, pulse)
    return make_profile(shape_map(t, d, v, a, j), distance, t, pulse)


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


def _peak_velocity(t: float, d: float, v: float, a: float, j: float) -> tuple[float, float]:
    """Peak velocity of f_A^-1 and f_J^-1, and the time c that they rise: t/2 unless V binds."""
    peak = 2.0 * d / t
    if peak < v:
        return peak, 0.5 * t
    return v, max(t - d / v, a / j + v / a)


def acceleration_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """f_A^-1: the smaller root of (60) or (63)."""
    if d == 0.0:
        return 0.0, 0.5 * t, 0.0, j
    peak, c = _peak_velocity(t, d, v, a, j)
    lowest = min(a, 2.0 * peak / (c + sqrt(max(c * c - 4.0 * peak / j, 0.0))))
    tj = lowest / j
    ta = peak / lowest - tj
    if ta < 0.0:
        ta = 0.0
    tv = t - 2.0 * ta - 4.0 * tj
    return tj, ta, tv if tv > 0.0 else 0.0, j


def jerk_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """f_J^-1: acceleration saturated, (70) or (79), if two jerk pulses alone would exceed it; else (75) or (77)."""
    peak, c = _peak_velocity(t, d, v, a, j)
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


SHAPE_MAPS: dict[str, ShapeMap] = {
    "velocity": velocity_shape,
    "acceleration": acceleration_shape,
    "jerk": jerk_shape,
}


def shape_map(minimise: Minimise) -> ShapeMap:
    """The inverse map by its name; ValueError for an unknown one."""
    try:
        return SHAPE_MAPS[minimise]
    except KeyError:
        raise ValueError(f"minimise = {minimise!r}: must be one of {sorted(SHAPE_MAPS)}") from None
