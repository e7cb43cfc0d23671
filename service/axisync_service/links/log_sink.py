"""Entries for the recorder, over a socket that never makes the sender wait: what did not fit is counted and said."""

import logging
import socket
import time
from typing import Any

from axisync_schemas.internal import MAX_PACKET, LogEntry

log = logging.getLogger(__name__)


class LogSink:
    """Sends `LogEntry` packets.

    Attributes:
        lost: entries that did not fit, until `take_lost`.
        failing: the last entry did not fit.
    """

    def __init__(self, descriptor: int | None) -> None:
        self._socket = socket.socket(fileno=descriptor) if descriptor is not None else None
        if self._socket is not None:
            self._socket.setblocking(False)
        self.lost = 0
        self.failing = False

    def send(self, topic: str, data: dict[str, Any], slot: int | None = None, plan_id: int | None = None) -> bool:
        """Sends an entry; False where it was lost."""
        if self._socket is None:
            return False
        entry = LogEntry(topic=topic, log_time_ns=time.monotonic_ns(), data=data, slot=slot, plan_id=plan_id)
        packet = entry.model_dump_json().encode()
        try:
            if len(packet) > MAX_PACKET:
                raise OSError(f"an entry of {len(packet)} bytes is too long")
            self._socket.send(packet)
        except OSError as error:
            self._count(topic, error)
            return False
        self.failing = False
        return True

    def take_lost(self) -> int:
        """How many were lost since this was last asked and the log worked again; 0 while it does not."""
        if self.failing:
            return 0
        lost, self.lost = self.lost, 0
        return lost

    def close(self) -> None:
        """Closes this end."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _count(self, topic: str, error: OSError) -> None:
        if not self.failing:
            log.warning("log entry lost topic=%s error=%r", topic, str(error))
        self.failing = True
        self.lost += 1
