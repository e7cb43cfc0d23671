"""The grid clock: t[k] = t0 + k * period. Ticks are skipped whole, counted, and never made up for in a burst."""

import time
from dataclasses import dataclass
from typing import Protocol

SPIN_NS = 100_000
"""Sleep until this long before the tick, then spin: plain sleep was 2.5 times as late at p99."""
SLACK_SHARE = 0.05


class TimeSource(Protocol):
    """Monotonic time: the machine's, or the bus's in lock-step."""

    def now_ns(self) -> int:
        """Now, ns."""
        ...

    def wait_until_ns(self, instant_ns: int) -> None:
        """Returns at `instant_ns` or later."""
        ...


class MonotonicTime:
    """CLOCK_MONOTONIC, by sleep and spin."""

    now_ns = staticmethod(time.monotonic_ns)

    def wait_until_ns(self, instant_ns: int) -> None:
        """Sleeps, then spins."""
        early = instant_ns - SPIN_NS - time.monotonic_ns()
        if early > 0:
            time.sleep(early * 1e-9)
        while time.monotonic_ns() < instant_ns:
            pass


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick that is executed.

    Attributes:
        index: k; skipped ticks before it are index - skipped ... index - 1.
        start_ns: when the loop woke; due_ns: t[k].
    """

    index: int
    due_ns: int
    start_ns: int
    skipped: int

    @property
    def lateness_ns(self) -> int:
        """Wake-up after the grid, ns."""
        return self.start_ns - self.due_ns


class GridClock:
    """Hands out ticks. One that wakes later than period - worst wire time - 5 % has no room left: it is skipped."""

    def __init__(self, source: TimeSource, period_ns: int, worst_wire_ns: int) -> None:
        self.source = source
        self.period_ns = period_ns
        self.latest_ns = max(period_ns // 10, period_ns - worst_wire_ns - round(SLACK_SHARE * period_ns))
        self.first = 1
        self._origin_ns = 0
        self._next = 1

    def start(self) -> None:
        """Tick `first` is one period from now."""
        self._origin_ns = self.source.now_ns() - (self.first - 1) * self.period_ns
        self._next = self.first

    def due_ns(self, index: int) -> int:
        """t[k] on the grid."""
        return self._origin_ns + index * self.period_ns

    def wait(self) -> Tick:
        """The next tick that can still be executed in time."""
        first = self._next
        while True:
            due = self.due_ns(self._next)
            self.source.wait_until_ns(due)
            now = self.source.now_ns()
            if now - due <= self.latest_ns:
                tick = Tick(self._next, due, now, self._next - first)
                self._next += 1
                return tick
            self._next += max(1, (now - due) // self.period_ns)
