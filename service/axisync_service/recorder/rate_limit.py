"""Warnings from a loop: at most one a kind and second, with the number of those left out."""

import logging

INTERVAL_NS = 1_000_000_000


class RateLimited:
    """Logs key=value lines; each `kind` at most once in `INTERVAL_NS`."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._last: dict[str, int] = {}
        self._left_out: dict[str, int] = {}

    def warn(self, now_ns: int, kind: str, text: str) -> None:
        """Logs `kind=<kind> <text>`, or counts it."""
        last = self._last.get(kind)
        if last is not None and now_ns - last < INTERVAL_NS:
            self._left_out[kind] = self._left_out.get(kind, 0) + 1
            return
        self._last[kind] = now_ns
        left_out = self._left_out.pop(kind, 0)
        self._logger.warning("kind=%s %s%s", kind, text, f" left_out={left_out}" if left_out else "")
