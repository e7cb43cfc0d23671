"""Messages of the controller, held until the tick record shows what they say.

The controller decides in tick k what record k + 1 shows. Who is told "ended" and asks for the next move at once must
not be refused because the newest record still shows the last one.
"""

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")

PATIENCE_NS = 50_000_000


class Held(Generic[T]):
    """A queue in the order of arrival."""

    def __init__(self) -> None:
        self._queue: deque[tuple[int, int, T]] = deque()

    def __bool__(self) -> bool:
        return bool(self._queue)

    def put(self, message: T, tick: int, now_ns: int) -> None:
        """`tick`: the one in which it was decided."""
        self._queue.append((tick, now_ns + PATIENCE_NS, message))

    def due(self, newest: int, now_ns: int) -> list[T]:
        """Messages whose tick is past, and whatever has waited too long."""
        out = []
        while self._queue and (self._queue[0][0] < newest or self._queue[0][1] <= now_ns):
            out.append(self._queue.popleft()[2])
        return out

    def all(self) -> list[T]:
        """Everything, at once: the controller is gone."""
        out = [message for _, _, message in self._queue]
        self._queue.clear()
        return out
