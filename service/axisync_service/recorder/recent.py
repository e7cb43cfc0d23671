"""The newest ticks and messages, kept in memory for extracts: bounded in time and in bytes."""

from collections import deque
from dataclasses import dataclass

from axisync_service.recorder.entries import Message

MAX_MESSAGE_BYTES = 8 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick's record, and its instant on the monotonic clock."""

    tick: int
    start_ns: int
    record: bytes


class Recent:
    """What came within the last `span_ns`, whatever the file did with it."""

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._ticks: deque[Tick] = deque()
        self._messages: deque[Message] = deque()
        self._bytes = 0

    def add_tick(self, tick: int, start_ns: int, record: bytes) -> None:
        """Keeps a tick; one that came before already (its file failed) is kept once."""
        ticks = self._ticks
        if ticks and tick <= ticks[-1].tick and start_ns <= ticks[-1].start_ns:
            return
        ticks.append(Tick(tick, start_ns, record))
        while ticks[0].start_ns < start_ns - self._span_ns:
            ticks.popleft()

    def add_message(self, message: Message) -> None:
        """Keeps a message; the oldest make room."""
        self._messages.append(message)
        self._bytes += len(message.payload)
        oldest_ns = message.log_time_ns - self._span_ns
        while len(self._messages) > 1 and (
            self._bytes > MAX_MESSAGE_BYTES or self._messages[0].log_time_ns < oldest_ns
        ):
            self._bytes -= len(self._messages.popleft().payload)

    def ticks(self, first_ns: int, last_ns: int) -> list[Tick]:
        """Those between two instants, in order."""
        return [tick for tick in self._ticks if first_ns <= tick.start_ns <= last_ns]

    def messages(self, first_ns: int, last_ns: int) -> list[Message]:
        """Those between two instants, in the order in which they came."""
        return [message for message in self._messages if first_ns <= message.log_time_ns <= last_ns]
