"""The position demand between SYNCs: interpolation, extrapolation, ramps to rest. Counts, counts/s, ns."""

from axisync_emulator.timers import NEVER

RAMP_STEP_NS = 1_000_000
"""A ramp is followed in linear pieces no longer than this."""


class Demand:
    """Position over time: linear to a target, then on at the targets' own velocity, or held; or a ramp to rest.

    Going on is what extrapolation at constant velocity means, so a late SYNC needs nothing to be done. Its velocity is
    that between the last two targets, not that of the last stretch: a stretch after missed targets also makes good what
    extrapolation got wrong, and going on with that would make each gap's error a multiple of the last one's.
    """

    __slots__ = ("_cruise", "_deceleration", "_position", "_reach", "_target", "since", "until", "velocity")

    def __init__(self, position: float, now: int = 0) -> None:
        self.rest(position, now)

    def rest(self, position: float, now: int) -> None:
        """Stays at `position`."""
        self._position = position
        self.since = self.until = now
        self.velocity = 0.0
        self._deceleration = 0.0
        self._forget_targets()

    def _forget_targets(self) -> None:
        self._target, self._reach, self._cruise = 0.0, NEVER, 0.0

    def follow(self, target: float, now: int, period_ns: int, hold: bool) -> None:
        """Goes on from where it is so as to reach `target` one period from now, and holds it or passes through."""
        self._position = self.at(now)
        self.since = now
        self.until = now + period_ns if hold else NEVER
        self.velocity = (target - self._position) * 1e9 / period_ns
        self._deceleration = 0.0
        reach = now + period_ns
        if self._reach == NEVER:
            self._cruise = self.velocity
        else:
            cycles = max(1, round((reach - self._reach) / period_ns))  # whole ones: a SYNC's jitter is no velocity
            self._cruise = (target - self._target) * 1e9 / (cycles * period_ns)
        self._target, self._reach = target, reach

    def ramp(self, now: int, deceleration: float) -> int:
        """Slows at `deceleration` (counts/s^2) from its present velocity; returns when it rests."""
        return self.ramp_from(self.at(now), self.velocity_at(now), now, deceleration)

    def ramp_from(self, position: float, velocity: float, now: int, deceleration: float) -> int:
        """Slows from this position and velocity; returns when it rests."""
        self._position, self.velocity = position, velocity
        self.since = now
        self.until = now + round(abs(velocity) / deceleration * 1e9)
        self._deceleration = -deceleration if velocity > 0.0 else deceleration
        self._forget_targets()
        return self.until

    def at(self, now: int) -> float:
        """Position at `now`, not before `since`."""
        if now > self._reach and self.until == NEVER:
            return self._target + self._cruise * (now - self._reach) * 1e-9
        elapsed = (min(now, self.until) - self.since) * 1e-9
        return self._position + elapsed * (self.velocity + 0.5 * self._deceleration * elapsed)

    def velocity_at(self, now: int) -> float:
        """Velocity at `now`."""
        if now >= self.until:
            return 0.0
        if now >= self._reach and self.until == NEVER:
            return self._cruise
        return self.velocity + self._deceleration * (now - self.since) * 1e-9

    def linear_until(self, start: int, end: int) -> int:
        """The last instant up to `end` before which the demand is linear from `start` on, or nearly."""
        if start >= self.until:
            return end
        if self._deceleration:
            end = min(end, start + RAMP_STEP_NS)
        elif start < self._reach < end:
            end = self._reach
        return min(end, self.until)
