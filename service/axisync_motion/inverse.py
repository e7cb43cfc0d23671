"""The inverse maps: the gentlest motion of one axis that takes a given time. f_V^-1, f_A^-1 and f_J^-1.

The cruise is what is left of the time, so that the axes of a move last equally long to the last bits.
"""

from collections.abc import Callable
from typing import Literal

from .checks import check_axis, check_duration
from .closed_forms import (
    ACCELERATION,
    DURATION_TOLERANCE,
    JERK,
    VELOCITY,
    Shape,
    acceleration_shape,
    capped_acceleration,
    jerk_shape,
    optimal_shape,
    shortest,
    velocity_shape,
)
from .errors import InfeasibleDuration
from .s_curve import Profile, Pulse, make_profile, mean_jerk

Minimise = Literal["acceleration", "velocity", "jerk"]
ShapeMap = Callable[[float, float, float, float, float], Shape]


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


SHAPE_MAPS: dict[str, ShapeMap] = {
    "velocity": velocity_shape,
    "acceleration": acceleration_shape,
    "jerk": jerk_shape,
}

MINIMISE_CODES: dict[Minimise, int] = {"velocity": VELOCITY, "acceleration": ACCELERATION, "jerk": JERK}


def shape_map(minimise: Minimise) -> ShapeMap:
    """The inverse map by its name; ValueError for an unknown one."""
    try:
        return SHAPE_MAPS[minimise]
    except KeyError:
        raise ValueError(f"minimise = {minimise!r}: must be one of {sorted(SHAPE_MAPS)}") from None
