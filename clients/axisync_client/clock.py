"""The daemon's monotonic clock as seen from here, so that a command held up on its way is never carried out late."""

from threading import Lock


class DaemonClock:
    """Bounds, from every reply's `now_s`, how far the daemon's clock is ahead of ours."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._lock = Lock()

    def observe(self, now_s: float, sent_s: float, received_s: float) -> None:
        """`now_s` of a reply to a request sent at our `sent_s` and answered at our `received_s`.

        It lay between the two, so the offset lies in an interval. The largest value that agrees with every reply so
        far is kept; a reply that contradicts it (the daemon runs on another machine now) starts afresh.
        """
        least, most = now_s - received_s, now_s - sent_s
        with self._lock:
            if self._ahead_s is None or not least <= self._ahead_s <= most:
                self._ahead_s = most

    def at(self, local_s: float) -> float | None:
        """Our instant on the daemon's clock, too late by no more than a request's way; None before the first reply."""
        with self._lock:
            return None if self._ahead_s is None else local_s + self._ahead_s
