"""Periodic work on the monotonic clock. What is late is done once, never made up for in a burst."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(slots=True)
class Timer:
    """Work due every `period_ns`."""

    period_ns: int
    work: Callable[[], None]
    due_ns: int


class Timers:
    """A few timers of one thread."""

    def __init__(self) -> None:
        self._timers: list[Timer] = []

    def every(self, period_s: float, work: Callable[[], None], now_ns: int) -> None:
        """Adds work."""
        period_ns = round(period_s * 1e9)
        self._timers.append(Timer(period_ns, work, now_ns + period_ns))

    def wait_s(self, now_ns: int) -> float:
        """Until the next is due."""
        return max(0.0, (min(timer.due_ns for timer in self._timers) - now_ns) / 1e9)

    def run(self, now_ns: int) -> None:
        """Does what is due."""
        for timer in self._timers:
            if timer.due_ns <= now_ns:
                late = (now_ns - timer.due_ns) // timer.period_ns
                timer.due_ns += (late + 1) * timer.period_ns
                timer.work()
