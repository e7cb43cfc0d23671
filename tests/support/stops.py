"""The best stop that any path clock could make: of one axis alone, time-optimal."""

from math import sqrt


def alone(v: float, a: float, a_max: float, j_max: float) -> float:
    """Shortest time, s, from velocity v and acceleration a to 0, 0 within |acceleration| and |jerk|; |a| <= a_max."""
    if v + a * abs(a) / (2.0 * j_max) < 0.0:  # where it would be if a were taken to 0 at once
        v, a = -v, -a
    peak = sqrt(max(j_max * v + a * a / 2.0, 0.0))
    if peak <= a_max:
        return (a + 2.0 * peak) / j_max
    return (a + 2.0 * a_max) / j_max + (v + a * a / (2.0 * j_max) - a_max * a_max / j_max) / a_max
