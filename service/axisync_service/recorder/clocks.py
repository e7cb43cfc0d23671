"""Both clocks of a log file: instants are monotonic; one offset, measured when the file is opened, makes wall times.

One offset a file: its times stay in order and evenly spaced when somebody sets the wall clock.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

NanosecondClock = Callable[[], int]
_READINGS = 5


@dataclass(frozen=True, slots=True)
class ClockPair:
    """One instant on both clocks, ns."""

    monotonic_ns: int
    wall_ns: int

    @property
    def offset_ns(self) -> int:
        """Wall minus monotonic."""
        return self.wall_ns - self.monotonic_ns

    def wall(self, monotonic_ns: int) -> int:
        """Wall time of a monotonic instant, ns since 1970; never below 0, which a log cannot hold."""
        return max(0, monotonic_ns + self.offset_ns)

    def iso(self, monotonic_ns: int) -> str:
        """Wall time of a monotonic instant: ISO 8601, UTC, microseconds."""
        return datetime.fromtimestamp(self.wall(monotonic_ns) / 1e9, UTC).isoformat(timespec="microseconds")

    def stamp(self) -> str:
        """Wall time of the pair as in file names: yyyymmddThhmmssZ."""
        return datetime.fromtimestamp(self.wall_ns / 1e9, UTC).strftime("%Y%m%dT%H%M%SZ")

    def metadata(self) -> dict[str, str]:
        """As the log's metadata record says it."""
        return {
            "monotonic_ns": str(self.monotonic_ns),
            "wall_ns": str(self.wall_ns),
            "offset_ns": str(self.offset_ns),
            "wall_time": self.iso(self.monotonic_ns),
            "log_time": "CLOCK_MONOTONIC of the event plus offset_ns; /setpoints: of cycle_start_ns",
        }


def measure(monotonic: NanosecondClock = time.monotonic_ns, wall: NanosecondClock = time.time_ns) -> ClockPair:
    """The pair whose reading took the shortest, of a few."""
    pairs = []
    for _ in range(_READINGS):
        before = monotonic()
        wall_ns = wall()
        after = monotonic()
        pairs.append((after - before, (before + after) // 2, wall_ns))
    _, monotonic_ns, wall_ns = min(pairs)
    return ClockPair(monotonic_ns, wall_ns)
