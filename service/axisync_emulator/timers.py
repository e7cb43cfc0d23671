"""Timers of the simulation: fired in the order of their time, never by the wall clock."""

from collections.abc import Callable
from heapq import heappop, heappush

NEVER = 1 << 62
"""A time ns that does not come."""

Callback = Callable[[int], None]


class Timer:
    """Fires its callback once at `deadline`. Moving the deadline later costs nothing: watchdogs do so every cycle.

    Attributes:
        stretch: how much longer its times last than they should: its owner's clock is slow (> 1) or fast (< 1).
    """

    __slots__ = ("_queued", "callback", "deadline", "order", "stretch", "timers")

    def __init__(self, timers: "Timers", order: int, callback: Callback) -> None:
        self.timers = timers
        self.order = order
        self.callback = callback
        self.stretch = 1.0
        self.deadline = NEVER
        self._queued = NEVER

    def set(self, at: int) -> None:
        """Fires at `at` ns, and at no time set before."""
        if self.stretch != 1.0:
            at = self.timers.now + round((at - self.timers.now) * self.stretch)
        self.deadline = at
        if at < self._queued:
            self._queued = at
            heappush(self.timers.heap, (at, self.order, self))

    def cancel(self) -> None:
        """Does not fire."""
        self.deadline = NEVER

    @property
    def running(self) -> bool:
        """It will fire."""
        return self.deadline < NEVER

    def reached(self, entry: int) -> None:
        """Its entry of the heap has come up: fire, or wait on where the deadline was moved."""
        if entry != self._queued:
            return
        self._queued = NEVER
        deadline = self.deadline
        if deadline > entry:
            if deadline < NEVER:
                self._queued = deadline
                heappush(self.timers.heap, (deadline, self.order, self))
            return
        self.deadline = NEVER
        self.callback(entry)


class Timers:
    """All timers of one bus; equal times fire in the order in which the timers were made.

    Attributes:
        now: of what happens at this moment, ns: a timer fires, or a frame is delivered.
    """

    __slots__ = ("_count", "heap", "now")

    def __init__(self) -> None:
        self.now = 0
        self.heap: list[tuple[int, int, Timer]] = []
        self._count = 0

    def make(self, callback: Callback) -> Timer:
        """A timer that is not set."""
        self._count += 1
        return Timer(self, self._count, callback)

    @property
    def next(self) -> int:
        """When to look again; it may turn out that nothing fires then."""
        return self.heap[0][0] if self.heap else NEVER

    def fire(self) -> None:
        """Takes the first entry."""
        at, _, timer = heappop(self.heap)
        self.now = at
        timer.reached(at)
