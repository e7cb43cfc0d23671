"""The fastest motion of one axis: F (33), f (36) and f_t (44), in the corrected and stable forms."""

from math import cbrt, sqrt

from .checks import check_axis, check_duration
from .s_curve import Profile, Pulse, Shape, capped_acceleration, make_profile, mean_jerk


def time_optimal(distance: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant") -> Profile:
    """F, eq. (33): the fastest rest-to-rest motion over a signed distance, in any consistent units.

    Raises InvalidLimits for a limit that is not positive and finite, or a distance that is not finite.
    """
    check_axis(distance, v_max, a_max, j_max)
    d, j = abs(distance), mean_jerk(j_max, pulse)
    a = capped_acceleration(v_max, a_max, j)
    t = shortest(d, v_max, a, j)
    return make_profile(optimal_shape(t, d, v_max, a, j), distance, t, pulse)


def duration(distance: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant") -> float:
    """f, eq. (36) corrected: the shortest duration of a rest-to-rest motion over a signed distance.

    Raises InvalidLimits as time_optimal.
    """
    check_axis(distance, v_max, a_max, j_max)
    j = mean_jerk(j_max, pulse)
    return shortest(abs(distance), v_max, capped_acceleration(v_max, a_max, j), j)


def max_distance(t: float, v_max: float, a_max: float, j_max: float, *, pulse: Pulse = "constant") -> float:
    """f_t, eq. (44): the longest distance that a rest-to-rest motion can cover in time t.

    Raises InvalidLimits as time_optimal, and for a time that is negative or not finite.
    """
    check_axis(0.0, v_max, a_max, j_max)
    check_duration(t)
    j = mean_jerk(j_max, pulse)
    a = capped_acceleration(v_max, a_max, j)
    tj = a / j
    t_up = tj + v_max / a
    if t >= 2.0 * t_up:
        return v_max * (t - t_up)
    if t >= 4.0 * tj:
        return a * t * (t - 2.0 * tj) / 4.0
    return j * t * t * t / 32.0


def shortest(d: float, v: float, a: float, j: float) -> float:
    """f, eq. (36) corrected, for d >= 0 and an acceleration already capped by (23)."""
    tj = a / j
    t_up = tj + v / a
    if d >= v * t_up:
        return t_up + d / v
    if d >= 2.0 * a * tj * tj:
        return tj + sqrt(tj * tj + 4.0 * d / a)
    return 4.0 * cbrt(d / (2.0 * j))


def optimal_shape(t: float, d: float, v: float, a: float, j: float) -> Shape:
    """F, eqs. (21), (29) and (32), for d >= 0, a capped by (23) and t = shortest(d, v, a, j)."""
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
