"""Warnings and errors of a process on their way to the log's `/log`: bounded in rate, and never waiting."""

import contextlib
import logging
import os
import socket
import sys
import time
from collections.abc import Callable

from axisync_schemas.internal import MAX_PACKET, LogEntry
from axisync_schemas.log_models import LogLevel, LogLine, WallTime
from axisync_schemas.topics import LOG_LINES

LINES_A_SECOND = 20
MESSAGE_CHARACTERS = 2000
_SECOND_NS = 1_000_000_000


def level_of(number: int) -> LogLevel:
    """foxglove's level of one of `logging`."""
    if number >= logging.CRITICAL:
        return LogLevel.FATAL
    if number >= logging.ERROR:
        return LogLevel.ERROR
    return LogLevel.WARNING if number >= logging.WARNING else LogLevel.INFO


class Quota:
    """At most `limit` in each second; counts what was too much."""

    def __init__(self, limit: int = LINES_A_SECOND) -> None:
        self._limit = limit
        self._second = -1
        self._used = 0
        self._left_out = 0

    def take(self, now_ns: int) -> int | None:
        """How many were left out since the last that passed; None: this one is too much as well."""
        second = now_ns // _SECOND_NS
        if second != self._second:
            self._second, self._used = second, 0
        if self._used >= self._limit:
            self._left_out += 1
            return None
        self._used += 1
        left_out, self._left_out = self._left_out, 0
        return left_out


class LineHandler(logging.Handler):
    """Hands each warning or error to `deliver` as the fields of a `LogLine`, with its time (wall, ns)."""

    def __init__(self, process: str, deliver: Callable[[LogLine, int], None]) -> None:
        super().__init__(logging.WARNING)
        self._process = process
        self._deliver = deliver
        self._quota = Quota()

    def emit(self, record: logging.LogRecord) -> None:
        """Never raises, never waits."""
        try:
            wall_ns = round(record.created * 1e6) * 1000
            left_out = self._quota.take(wall_ns)
            if left_out is not None:
                self._deliver(self._line(record, wall_ns, left_out), wall_ns)
        except Exception:  # A log line must not stop what it tells of.
            self.handleError(record)

    def _line(self, record: logging.LogRecord, wall_ns: int, left_out: int) -> LogLine:
        text = record.getMessage()
        if record.exc_info and record.exc_info[1] is not None:
            text += f" error={record.exc_info[1]!r}"
        return LogLine(
            timestamp=WallTime.of(wall_ns),
            level=level_of(record.levelno),
            message=text[:MESSAGE_CHARACTERS] + (f" left_out={left_out}" if left_out else ""),
            name=self._process,
            file=record.filename,
            line=max(0, record.lineno),
        )

    def handleError(self, record: logging.LogRecord) -> None:
        """Nowhere to complain to but stderr."""
        print(f"log line lost: {record.msg!r}", file=sys.stderr)


class LineSender(LineHandler):
    """Sends its lines to the recorder over a copy of the log socket `descriptor`; what does not fit is dropped."""

    def __init__(self, process: str, descriptor: int, monotonic: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__(process, self._send)
        self._monotonic = monotonic
        self._socket = socket.socket(fileno=os.dup(descriptor))
        self._socket.setblocking(False)

    def _send(self, line: LogLine, _wall_ns: int) -> None:
        entry = LogEntry(topic=LOG_LINES, log_time_ns=self._monotonic(), data=line.model_dump(mode="json"))
        packet = entry.model_dump_json().encode()
        if len(packet) <= MAX_PACKET:
            with contextlib.suppress(OSError):
                self._socket.send(packet)

    def close(self) -> None:
        """Closes the copy."""
        self._socket.close()
        super().close()
