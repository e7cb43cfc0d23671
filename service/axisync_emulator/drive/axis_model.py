"""The axis behind the drive: closed position loop and mechanics as one second-order system, solved exactly."""

import math
from functools import lru_cache

BANDWIDTH_HZ = 60.0
DAMPING = 0.9
_OMEGA = 2.0 * math.pi * BANDWIDTH_HZ
_STIFFNESS = _OMEGA * _OMEGA
_DECAY = DAMPING * _OMEGA
_DAMPED = _OMEGA * math.sqrt(1.0 - DAMPING**2)
LAG_S = 2.0 * DAMPING / _OMEGA
"""How far behind a demand of constant velocity the axis runs, s."""
_LIMITED_STEP_NS = 100_000
"""While the torque limit acts there is no closed solution: short steps."""


@lru_cache(maxsize=256)
def _response(duration_ns: int) -> tuple[float, float, float, float]:
    """Transition matrix of y'' + 2 d w y' + w^2 y = 0: (y, y') after this time from (1, 0) and (0, 1)."""
    time = duration_ns * 1e-9
    fading = math.exp(-_DECAY * time)
    cosine, sine = fading * math.cos(_DAMPED * time), fading * math.sin(_DAMPED * time) / _DAMPED
    return cosine + _DECAY * sine, sine, -_STIFFNESS * sine, cosine - _DECAY * sine


class AxisModel:
    """x'' = w^2 (u - x) - 2 d w x', as far as the torque goes; counts and counts/s.

    The loop compensates friction, so that this only costs torque: `friction` and `limit` are accelerations that as much
    torque would give the axis, counts/s^2.
    """

    __slots__ = ("_limited", "coulomb", "limit", "position", "velocity", "viscous")

    def __init__(self, position: float) -> None:
        self.position = position
        self.velocity = 0.0
        self.limit = math.inf
        self.coulomb = 0.0
        self.viscous = 0.0
        self._limited = False

    def step(self, duration_ns: int, demand: float, demand_end: float) -> None:
        """Moves on while the demand u goes linearly from one value to the other; exact within the torque limit."""
        slope = (demand_end - demand) * 1e9 / duration_ns
        lag = LAG_S * slope
        # The deviation from the steady state u - lag decays by itself.
        y, dy = self.position - demand + lag, self.velocity - slope
        a, b, c, d = _response(duration_ns)
        position, velocity = demand_end - lag + a * y + b * dy, slope + c * y + d * dy
        wanted = _STIFFNESS * (demand_end - position) - 2.0 * _DECAY * velocity
        limit = self.limit - self.coulomb - self.viscous * abs(velocity)
        if self._limited or not -limit <= wanted <= limit:
            self._limited = self._step_limited(duration_ns, demand, slope)
            return
        self.position, self.velocity = position, velocity

    def _step_limited(self, duration_ns: int, demand: float, slope: float) -> bool:
        """Whether the limit still acted at the end."""
        low = high = wanted = 0.0
        elapsed = 0
        while elapsed < duration_ns:
            step = min(_LIMITED_STEP_NS, duration_ns - elapsed)
            elapsed += step
            time = step * 1e-9
            wanted = self.acceleration(demand + slope * elapsed * 1e-9)
            friction = self.friction()
            low, high = -self.limit - friction, self.limit - friction
            self.velocity += min(max(wanted, low), high) * time
            self.position += self.velocity * time
        return not low <= wanted <= high

    def acceleration(self, demand: float) -> float:
        """That the loop asks for at this instant, counts/s^2."""
        return _STIFFNESS * (demand - self.position) - 2.0 * _DECAY * self.velocity

    def friction(self) -> float:
        """Of the moving axis, against which the loop works, counts/s^2."""
        velocity = self.velocity
        if velocity > 1.0:
            return self.coulomb + self.viscous * velocity
        if velocity < -1.0:
            return self.viscous * velocity - self.coulomb
        return 0.0
