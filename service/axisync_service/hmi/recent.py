"""The newest events, for who asks later what happened."""

from collections import deque

KEPT = 200


class RecentEvents:
    """Events as they were published; encoded once."""

    def __init__(self) -> None:
        self._payloads: deque[bytes] = deque(maxlen=KEPT)

    def add(self, payload: bytes) -> None:
        """Keeps one, and forgets the oldest beyond `KEPT`."""
        self._payloads.append(payload)

    def answer(self, now_s: float) -> bytes:
        """An `Events`."""
        return b'{"now_s":%r,"events":[%b]}' % (now_s, b",".join(self._payloads))
