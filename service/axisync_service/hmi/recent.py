"""The newest events, for who asks later what happened."""

from collections import deque

from axisync_schemas.events import EventKind

KEPT, KEPT_OF_FREQUENT = 200, 20
FREQUENT = frozenset({EventKind.TICKS_SKIPPED})
"""May come every second on a busy machine; they must not push out everything else."""


class RecentEvents:
    """Events as they were published; encoded once."""

    def __init__(self) -> None:
        self._usual: deque[tuple[int, bytes]] = deque(maxlen=KEPT)
        self._frequent: deque[tuple[int, bytes]] = deque(maxlen=KEPT_OF_FREQUENT)

    def add(self, number: int, kind: str, payload: bytes) -> None:
        """Keeps one, and forgets the oldest of its sort when there are many."""
        (self._frequent if kind in FREQUENT else self._usual).append((number, payload))

    def answer(self, now_s: float) -> bytes:
        """An `Events`, the oldest first."""
        payloads = (payload for _, payload in sorted([*self._usual, *self._frequent]))
        return b'{"now_s":%r,"events":[%b]}' % (now_s, b",".join(payloads))
