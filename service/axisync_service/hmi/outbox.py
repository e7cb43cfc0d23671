"""Sends replies and samples from a thread of its own: a client that does not read holds up this one, not the actor."""

import logging
import queue
import threading
from collections.abc import Callable

log = logging.getLogger(__name__)

MAX_REPLIES = 4096
MAX_SAMPLES = 256

Send = Callable[[], None]


class Outbox:
    """A bounded queue of things to send. Samples are dropped first; a dropped reply is a query that times out.

    Attributes:
        dropped: samples and replies that were not sent.
    """

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Send | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="outbox", daemon=True)
        self.dropped = 0
        self._thread.start()

    def reply(self, send: Send) -> None:
        """Something that somebody waits for."""
        self._put(send, MAX_REPLIES)

    def publish(self, send: Send) -> None:
        """A sample: newer ones follow."""
        self._put(send, MAX_SAMPLES)

    def close(self, timeout_s: float) -> bool:
        """Sends what is queued, and ends; False where that took too long."""
        self._queue.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _put(self, send: Send, most: int) -> None:
        if self._queue.qsize() >= most:
            self.dropped += 1
        else:
            self._queue.put(send)

    def _run(self) -> None:
        while (send := self._queue.get()) is not None:
            try:
                send()
            except Exception as error:  # The client has gone, or the session is closing.
                self.dropped += 1
                log.debug("not sent error=%r", error)
