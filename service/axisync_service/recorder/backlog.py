"""JSON messages until their chunk has reached the kernel: a file that fails is followed by one that has them again."""

from collections import deque
from collections.abc import Iterator

from axisync_service.recorder.entries import Message

MAX_BYTES = 16 * 1024 * 1024


class Backlog:
    """The newest messages, at most `limit` bytes of payload; `dropped` counts those that were too many."""

    def __init__(self, limit: int = MAX_BYTES) -> None:
        self._messages: deque[Message] = deque()
        self._limit = limit
        self._bytes = 0
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._messages)

    def __iter__(self) -> Iterator[Message]:
        return iter(self._messages)

    def add(self, message: Message) -> None:
        """Keeps a message; the oldest make room, the newest stays even where it alone is too large."""
        self._messages.append(message)
        self._bytes += len(message.payload)
        while self._bytes > self._limit and len(self._messages) > 1:
            self._bytes -= len(self._messages.popleft().payload)
            self.dropped += 1

    def clear(self) -> None:
        """All of them have reached the kernel."""
        self._messages.clear()
        self._bytes = 0
