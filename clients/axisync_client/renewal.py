"""Keeps a lease alive from a thread of its own, and says loudly when that ends."""

import time
from collections.abc import Callable
from threading import Event, Thread

from axisync_client.errors import AxisyncError, Refused, Unavailable
from axisync_schemas.errors import ErrorCode

RENEWALS_PER_TTL = 3
PASSING = frozenset({ErrorCode.BUSY, ErrorCode.RATE_LIMITED, ErrorCode.UNAVAILABLE, ErrorCode.INTERNAL})
"""Refusals of a renewal that may not come again; every other one means that the lease is no longer ours."""


def is_final(error: AxisyncError) -> bool:
    """Whether trying again before the lease runs out is in vain."""
    if isinstance(error, Unavailable):
        return False
    return not (isinstance(error, Refused) and error.code in PASSING)


class Renewal:
    """Calls `renew` three times in the lease's life until stopped; calls `lose` once, at the latest when it lapses."""

    def __init__(
        self, ttl_s: float, valid_until: float, renew: Callable[[float], float], lose: Callable[[AxisyncError], None]
    ) -> None:
        """Starts at once.

        Args:
            valid_until: our monotonic instant at which the lease lapses if it is not renewed.
            renew: given a time-out, the instant until which the lease is valid then; raises AxisyncError.
            lose: told why.
        """
        self._period_s = ttl_s / RENEWALS_PER_TTL
        self._valid_until = valid_until
        self._renew = renew
        self._lose = lose
        self._stopping = Event()
        self._thread = Thread(target=self._run, name="axisync-lease", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends without a word; may be called from `lose`."""
        self._stopping.set()

    def _run(self) -> None:
        pause_s = self._period_s
        while not self._stopping.wait(pause_s):
            error = self._attempt()
            if self._stopping.is_set():
                return
            if error is not None and (is_final(error) or time.monotonic() >= self._valid_until):
                self._lose(error)
                return
            pause_s = self._period_s if error is None else self._period_s / 4

    def _attempt(self) -> AxisyncError | None:
        left = self._valid_until - time.monotonic()
        try:
            self._valid_until = self._renew(max(0.05, min(self._period_s, left)))
        except AxisyncError as error:
            return error
        return None
