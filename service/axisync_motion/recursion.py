"""The sampling recursion of eqs. (10) and (12): one period after the other, ending exactly on the target."""

from collections.abc import Iterator
from itertools import accumulate
from math import ceil, isfinite

from .s_curve import Profile

State = tuple[float, float, float, float]
"""Position, velocity, acceleration, jerk."""


def sample_count(duration: float, period: float) -> int:
    """n of eq. (12): periods until the end, rounded up (but not for a remainder that is only rounding)."""
    if not (period > 0.0 and isfinite(period)):
        raise ValueError(f"period = {period!r}: must be positive and finite")
    return ceil(duration / period * (1.0 - 1e-15))


def recursion(profile: Profile, period: float) -> Iterator[State]:
    """The n = sample_count states at period, 2 period, ..., the last at t_7: the target itself, at rest.

    Eq. (10), split where a period spans several segments, and carried to the fifth derivative for the parabolic pulse.
    The printed (12) overshoots the end by its last sample; here its time is clamped to t_7.
    """
    ends = list(accumulate(profile.T))
    count = sample_count(profile.duration, period)
    state = (0.0, 0.0, 0.0)
    now, segment = 0.0, 0
    for k in range(1, count):
        until = k * period
        while segment < 6 and ends[segment] <= until:
            state = _advance(profile, segment, now - _begin(ends, segment), ends[segment] - now, state)[:3]
            now = ends[segment]
            segment += 1
        *moved, jerk = _advance(profile, segment, now - _begin(ends, segment), until - now, state)
        state, now = (moved[0], moved[1], moved[2]), until
        yield (*state, jerk)
    if count:
        yield profile.distance, 0.0, 0.0, 0.0


def _begin(ends: list[float], segment: int) -> float:
    return ends[segment - 1] if segment else 0.0


def _advance(profile: Profile, segment: int, age: float, dt: float, state: tuple[float, float, float]) -> State:
    """Eq. (10): the state dt later, in a segment that began `age` ago, and its jerk there."""
    s, v, a = state
    jerk, snap, crackle = _pulse(profile, segment, age)
    return (
        s + dt * (v + dt / 2.0 * (a + dt / 3.0 * (jerk + dt / 4.0 * (snap + dt / 5.0 * crackle)))),
        v + dt * (a + dt / 2.0 * (jerk + dt / 3.0 * (snap + dt / 4.0 * crackle))),
        a + dt * (jerk + dt / 2.0 * (snap + dt / 3.0 * crackle)),
        jerk + dt * (snap + dt / 2.0 * crackle),
    )


def _pulse(profile: Profile, segment: int, age: float) -> tuple[float, float, float]:
    """The jerk and its two derivatives, `age` into a segment."""
    peak, length = profile.U[segment], profile.T[segment]
    if profile.pulse == "constant" or peak == 0.0 or length == 0.0:
        return peak, 0.0, 0.0
    x = age / length
    return 4.0 * peak * x * (1.0 - x), 4.0 * peak * (1.0 - 2.0 * x) / length, -8.0 * peak / length / length
