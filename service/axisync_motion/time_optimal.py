"""The fastest motion of one axis: F (33), f (36) and f_t (44), in the corrected and stable forms."""

from .checks import check_axis, check_duration
from .closed_forms import capped_acceleration, optimal_shape, shortest
from .s_curve import Profile, Pulse, make_profile, mean_jerk


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
