"""A token bucket for each user, so that a flood of one costs the others nothing. `stop` never passes through here."""

RATE_HZ = 500.0
BURST = 500.0


class RateLimiter:
    """Requests a second and in a burst, by user. Users come from the key and are checked before, so they are few."""

    def __init__(self, rate_hz: float = RATE_HZ, burst: float = BURST) -> None:
        self._rate = rate_hz / 1e9
        self._burst = burst
        self._buckets: dict[str, tuple[float, int]] = {}

    def allow(self, user: str, now_ns: int) -> bool:
        """Whether the user may send one request now."""
        level, since = self._buckets.get(user, (self._burst, now_ns))
        level = min(self._burst, level + (now_ns - since) * self._rate)
        allowed = level >= 1.0
        self._buckets[user] = (level - 1.0 if allowed else level, now_ns)
        return allowed
