"""The axis behind the drive: closed position loop and mechanics as one second-order system, solved exactly."""

import math
from functools import lru_cache

BANDWIDTH_HZ = 60.0
DAMPING = 0.9
_OMEGA = 2.0 * math.pi * BANDWIDTH_HZ
_DECAY = DAMPING * _OMEGA
_DAMPED = _OMEGA * math.sqrt(1.0 - DAMPING**2)
LAG_S = 2.0 * DAMPING / _OMEGA
"""How far behind a demand of constant velocity the axis runs, s."""


@lru_cache(maxsize=256)
def _response(duration_ns: int) -> tuple[float, float, float, float]:
    """Transition matrix of y'' + 2 d w y' + w^2 y = 0: (y, y') after this time from (1, 0) and (0, 1)."""
    time = duration_ns * 1e-9
    fading = math.exp(-_DECAY * time)
    cosine, sine = fading * math.cos(_DAMPED * time), fading * math.sin(_DAMPED * time) / _DAMPED
    return cosine + _DECAY * sine, sine, -_OMEGA * _OMEGA * sine, cosine - _DECAY * sine


class AxisModel:
    """x'' = w^2 (u - x) - 2 d w x'; counts and counts/s."""

    __slots__ = ("position", "velocity")

    def __init__(self, position: float) -> None:
        self.position = position
        self.velocity = 0.0

    def step(self, duration_ns: int, demand: float, demand_end: float) -> None:
        """Moves on while the demand u goes linearly from one value to the other; exact for any duration."""
        slope = (demand_end - demand) * 1e9 / duration_ns
        lag = LAG_S * slope
        # The deviation from the steady state u - lag decays by itself.
        y, dy = self.position - demand + lag, self.velocity - slope
        a, b, c, d = _response(duration_ns)
        self.position = demand_end - lag + a * y + b * dy
        self.velocity = slope + c * y + d * dy

    def acceleration(self, demand: float) -> float:
        """At this instant, counts/s^2."""
        return _OMEGA * _OMEGA * (demand - self.position) - 2.0 * _DECAY * self.velocity
