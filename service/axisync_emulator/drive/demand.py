"""The position demand between SYNCs: interpolation, extrapolation, ramps. Counts, counts/s, ns."""

from axisync_emulator.timers import NEVER

RAMP_STEP_NS = 1_000_000
"""A ramp is followed in linear pieces no longer than this."""


class Demand:
    """Position over time: linear to a target, then on at the targets' own velocity, or held; or a ramp to a velocity.

    Going on is what extrapolation at constant velocity means, so a late SYNC needs nothing to be done. Its velocity is
    that between the last two targets, not that of the last stretch: a stretch after missed targets also makes good what
    extrapolation got wrong, and going on with that would make each gap's error a multiple of the last one's.
    """

    __slots__ = ("_acceleration", "_cruise", "_final", "_position", "_reach", "_target", "since", "until", "velocity")

    def __init__(self, position: float, now: int = 0) -> None:
        self.rest(position, now)

    def rest(self, position: float, now: int) -> None:
        """Stays at `position`."""
        self._position = position
        self.since = self.until = now
        self.velocity = 0.0
        self._acceleration = self._final = 0.0
        self._forget_targets()

    def _forget_targets(self) -> None:
        self._target, self._reach, self._cruise = 0.0, NEVER, 0.0

    def follow(self, target: float, now: int, period_ns: int, hold: bool, cycles: int | None = None) -> None:
        """Goes on from where it is so as to reach `target` one period from now, and holds it or passes through.

        `cycles` is how many SYNCs were counted since the last target, however late any of them came; where None, as
        many as there was time for.
        """
        self._position = self.at(now)
        self.since = now
        self.until = now + period_ns if hold else NEVER
        self.velocity = (target - self._position) * 1e9 / period_ns
        self._acceleration = self._final = 0.0
        reach = now + period_ns
        if self._reach == NEVER:
            self._cruise = self.velocity
        else:
            cycles = cycles or max(1, round((reach - self._reach) / period_ns))
            self._cruise = (target - self._target) * 1e9 / (cycles * period_ns)
        self._target, self._reach = target, reach

    def ramp(self, now: int, deceleration: float) -> int:
        """Slows at `deceleration` (counts/s^2) from its present velocity; returns when it rests."""
        return self.ramp_from(self.at(now), self.velocity_at(now), now, deceleration)

    def cruise(self, now: int, velocity: float, acceleration: float) -> int:
        """Speeds up or slows to `velocity` and keeps it; returns when it has it."""
        return self.ramp_from(self.at(now), self.velocity_at(now), now, acceleration, velocity)

    def ramp_from(self, position: float, velocity: float, now: int, acceleration: float, final: float = 0.0) -> int:
        """From this position and velocity to the velocity `final`, which then stays; returns when it has it."""
        self._position, self.velocity, self._final = position, velocity, final
        self.since = now
        self.until = now + round(abs(final - velocity) / acceleration * 1e9)
        self._acceleration = acceleration if final > velocity else -acceleration
        self._forget_targets()
        return self.until

    def at(self, now: int) -> float:
        """Position at `now`, not before `since`."""
        if now > self._reach and self.until == NEVER:
            return self._target + self._cruise * (now - self._reach) * 1e-9
        until = self.until
        if now <= until:
            elapsed = (now - self.since) * 1e-9
            return self._position + elapsed * (self.velocity + 0.5 * self._acceleration * elapsed)
        elapsed = (until - self.since) * 1e-9
        reached = self._position + elapsed * (self.velocity + 0.5 * self._acceleration * elapsed)
        return reached + self._final * (now - until) * 1e-9

    def at_rest(self, now: int) -> bool:
        """It does not move."""
        return self.velocity_at(now) == 0.0

    def velocity_at(self, now: int) -> float:
        """Velocity at `now`."""
        if now >= self.until:
            return self._final
        if now >= self._reach and self.until == NEVER:
            return self._cruise
        return self.velocity + self._acceleration * (now - self.since) * 1e-9

    def next_target(self, now: int, period_ns: int, cycles: int | None) -> float:
        """The target that would go on as the last ones did, `cycles` SYNCs after them."""
        if self._reach == NEVER or cycles is None:
            return self.at(now + period_ns)
        return self._target + self._cruise * cycles * period_ns * 1e-9

    def linear_until(self, start: int, end: int) -> int:
        """The last instant up to `end` before which the demand is linear from `start` on, or nearly."""
        if start >= self.until:
            return end
        if self._acceleration:
            end = min(end, start + RAMP_STEP_NS)
        elif start < self._reach < end:
            end = self._reach
        return min(end, self.until)
