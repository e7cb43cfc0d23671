"""Published streams as iterators that drop the oldest when their reader is slow, and never block the publisher."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from threading import Condition
from types import TracebackType
from typing import Generic, Self, TypeVar

from axisync_client.link import Link

T = TypeVar("T")
CAPACITY = 1000
"""Decoded messages kept for a reader: 20 s of setpoints, 50 s of states."""


class Stream(Generic[T]):
    """Iterator over a topic; also a context manager. Ends when it or its client is closed.

    Attributes:
        missed: messages that were published and did not get here, by their numbers.
        silence_s: a wait as long as this ends in `inquire`.
    """

    def __init__(
        self,
        link: Link,
        key: str,
        decode: Callable[[bytes], tuple[T, int]],
        *,
        silence_s: float,
        on_silence: Callable[[], None],
    ) -> None:
        """Subscribes at once: what is published from here on is seen, also before the first `next`.

        Args:
            decode: the message and its number.
            silence_s: after so long without a message `on_silence` is called; it raises where silence is wrong.
        """
        self.missed = 0
        self.silence_s = silence_s
        self._decode = decode
        self._on_silence = on_silence
        self._wake: Callable[[], None] | None = None
        self._last_seq: int | None = None
        self._waiting: deque[bytes] = deque(maxlen=CAPACITY)
        self._changed = Condition()
        self._closed = False
        self._subscription = link.subscribe(key, self._put)

    def _put(self, payload: bytes) -> None:
        with self._changed:
            self._waiting.append(payload)
            self._tell()

    def _tell(self) -> None:
        self._changed.notify_all()
        if self._wake is not None:
            self._wake()

    def notify(self, wake: Callable[[], None]) -> None:
        """From now on `wake` is called, on another thread, when `poll` may have something new or the stream ends."""
        with self._changed:
            self._wake = wake

    def __iter__(self) -> Iterator[T]:
        return self

    def __next__(self) -> T:
        """The next message.

        Raises:
            StopIteration: closed.
            Unavailable: the daemon is gone, or a periodic stream went silent.
            UnexpectedReply: the message is of another schema.
        """
        while (payload := self._take()) is None:
            if self._closed:
                raise StopIteration
            self.inquire()
        return self._read(payload)

    def poll(self) -> T | None:
        """The next message if there is one; never waits.

        Raises:
            UnexpectedReply: the message is of another schema.
        """
        try:
            return self._read(self._waiting.popleft())
        except IndexError:
            return None

    def inquire(self) -> None:
        """Asks whether a silence is in order.

        Raises:
            Unavailable: the daemon is gone, or a periodic stream went silent.
        """
        self._on_silence()

    @property
    def closed(self) -> bool:
        """Nothing more will come than `poll` still has."""
        return self._closed

    def _read(self, payload: bytes) -> T:
        message, seq = self._decode(payload)
        self._count(seq)
        return message

    def _take(self) -> bytes | None:
        end = time.monotonic() + self.silence_s
        with self._changed:
            while not self._waiting and not self._closed:
                left = end - time.monotonic()
                if left <= 0:
                    return None
                self._changed.wait(left)
            return self._waiting.popleft() if self._waiting else None

    def _count(self, seq: int) -> None:
        if self._last_seq is not None and seq > self._last_seq:
            self.missed += seq - self._last_seq - 1
        self._last_seq = seq  # a smaller number: the daemon was restarted

    def close(self) -> None:
        """Unsubscribes; a reader that waits gets StopIteration. May be called twice, and from another thread."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._tell()
        self._subscription.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
