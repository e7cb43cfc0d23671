"""The recorder's loop: take entries, take ticks, write them, say how far the log has got.

The cursor in shared memory moves only when a chunk has reached the kernel. So whatever kills this process, the next one
goes on where the log ends, as long as the ring still holds the ticks.
"""

import errno
import logging
import mmap
import os
import socket
import struct
import time
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import Literal

from axisync_schemas.cell import Cell
from axisync_schemas.events import EventKind
from axisync_schemas.memory import Control, Word
from axisync_schemas.replies import Event
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.topics import LOG_EVENTS
from axisync_service.recorder.backlog import Backlog
from axisync_service.recorder.clocks import ClockPair, NanosecondClock, measure
from axisync_service.recorder.entries import Entries, Message
from axisync_service.recorder.gaps import Gap, GapReport
from axisync_service.recorder.log_file import LogFile
from axisync_service.recorder.rate_limit import RateLimited
from axisync_service.recorder.ring_reader import RingReader

SECOND_NS = 1_000_000_000
FLUSH_NS = 900_000_000
"""A message waits at most this long for its chunk to fill, and so reaches the kernel within a second."""
SYNC_NS = SECOND_NS
RETRY_NS = SECOND_NS
ROTATE_NS = 3600 * SECOND_NS
"""A file an hour: the writer keeps an index of its chunks in memory, about 17 MB an hour of 12 axes."""
MIN_FREE_BYTES = 4 * 1024 * 1024

Severity = Literal["info", "warning", "error"]
log = logging.getLogger(__name__)


class RecorderState(IntEnum):
    """`Word.RECORDER_STATE`."""

    NOT_STARTED = 0
    WRITING = 1
    FAILING = 2


class Recorder:
    """One cell's recorder; `open` once, `step` every 20 ms or so, `close` at the end."""

    def __init__(
        self,
        cell: Cell,
        cell_text: str,
        directory: Path,
        control: Control,
        ring: TickRing,
        plans: mmap.mmap | bytearray,
        sockets: Sequence[socket.socket],
        monotonic: NanosecondClock = time.monotonic_ns,
        wall: NanosecondClock = time.time_ns,
    ) -> None:
        self._cell, self._cell_text, self._directory = cell, cell_text, directory
        self._control = control
        self._reader = RingReader(control, ring)
        self._entries = Entries(sockets, plans)
        self._backlog = Backlog()
        self._monotonic, self._wall = monotonic, wall
        self._cycle_start = struct.Struct("<Q"), ring.layout.offset("cycle_start_ns")
        self._warnings = RateLimited(log)
        self._gaps = GapReport()
        self._missed_until = 0
        self._file: LogFile | None = None
        self._clocks: ClockPair = measure(monotonic, wall)
        self._opened_ns = self._synced_ns = 0
        self._failed_ns: int | None = None
        self._waiting_since: int | None = None
        self._plans: dict[str, Message] = {}

    @property
    def path(self) -> Path | None:
        """The file being written."""
        return self._file.path if self._file else None

    def open(self) -> None:
        """Opens a file with what no kernel has yet and each group's newest plan; makes the directory if need be.

        Raises:
            OSError: it cannot be made or written.
        """
        self._clocks = measure(self._monotonic, self._wall)
        self._reader.rewind()
        self._directory.mkdir(parents=True, exist_ok=True)
        self._file = LogFile(self._directory, self._cell, self._cell_text, self._clocks)
        self._opened_ns = self._synced_ns = self._clocks.monotonic_ns
        if self._control[Word.RECORDER_STATE] == RecorderState.NOT_STARTED:
            self._control[Word.RECORDER_STATE] = RecorderState.WRITING
        log.info("kind=log_opened file=%s next_tick=%d", self._file.path, self._reader.next_tick)
        waiting = list(self._backlog)
        self._backlog.clear()
        for message in [plan for plan in self._plans.values() if plan not in waiting] + waiting:
            self._add_json(message)
        self._event(
            EventKind.LOG_OPENED, "the log is open", file=str(self.path and self.path.name), tick=self._reader.next_tick
        )

    def step(self) -> bool:
        """One round; True where more waits already. Errors of the file are dealt with here."""
        now = self._monotonic()
        self._control[Word.RECORDER_NS] = now
        more = self._take_entries(now)
        try:
            if self._file is None:
                self._reopen(now)
            more = self._take_ticks() or more
            self._keep_times(now)
        except OSError as error:
            self._fail(error)
        return more and self._file is not None

    def close(self) -> bool:
        """Writes all that waits and ends the file; False where that failed."""
        while self.step():
            pass
        if self._file is None:
            self._failed_ns = None  # One more try, at once.
            while self.step():
                pass
        if self._finish():
            return True
        log.error("kind=log_incomplete ticks=%d messages=%d", self._reader.behind, len(self._backlog))
        return False

    def _finish(self) -> bool:
        name = self.path.name if self.path else None
        self._report(self._monotonic(), at_once=True)
        self._event(EventKind.LOG_CLOSED, "the log ends here", file=name, tick=self._reader.next_tick)
        if self._file is None:
            return False
        try:
            self._file.finish()
        except OSError as error:
            self._fail(error)
            return False
        self._on_kernel()
        log.info("kind=log_closed file=%s next_tick=%d", self._file.path, self._reader.next_tick)
        self._file = None
        return True

    def _take_entries(self, now: int) -> bool:
        received = self._entries.receive()
        for problem in received.problems:
            self._warnings.warn(now, "entry", f"problem={problem!r}")
        for message in received.messages:
            self._add_json(message)
        return received.more

    def _take_ticks(self) -> bool:
        if self._reader.restarted():
            log.warning("kind=ticks_anew newest=%d", self._reader.newest)
            self._missed_until = 0
            self._rotate()
        if self._file is None:
            return False
        records, gaps = self._reader.read()
        code, offset = self._cycle_start
        for tick, record in records:
            self._wait()
            if self._file.add_tick(record, tick, code.unpack_from(record, offset)[0]):
                self._on_kernel(tick + 1)  # The reader is further already.
        for gap in gaps:
            self._miss(gap)
        return self._reader.behind > 0

    def _miss(self, gap: Gap) -> None:
        """Counts a gap, but not the part that was counted before its file failed."""
        rest = Gap(max(gap.first, self._missed_until + 1), gap.last, gap.lost)
        if rest.ticks > 0:
            self._missed_until = rest.last
            self._gaps.add(rest)
            self._control[Word.RECORDER_LOST] += rest.ticks if rest.lost else 0

    def _keep_times(self, now: int) -> None:
        """Reports gaps, flushes what has waited, syncs, and begins a new file, each when it is time."""
        self._report(now)
        if self._file is None:
            return
        if self._waiting_since is not None and now - self._waiting_since >= FLUSH_NS and self._file.flush():
            self._on_kernel()
        if now - self._synced_ns >= SYNC_NS:
            self._synced_ns = now
            self._file.sync()
        if now - self._opened_ns >= ROTATE_NS:
            self._rotate()

    def _rotate(self) -> None:
        if self._finish():
            self.open()

    def _add_json(self, message: Message) -> None:
        """Into the file, and into the backlog until the kernel has it; never raises."""
        self._backlog.add(message)
        if message.group is not None:
            self._plans[message.group] = message
        if self._file is None:
            return
        self._wait()
        try:
            if self._file.add_json(message.topic, message.log_time_ns, message.payload):
                self._on_kernel()
        except OSError as error:
            self._fail(error)

    def _event(self, kind: EventKind, text: str, severity: Severity = "info", **details: object) -> None:
        now = self._monotonic()
        event = Event(
            source="recorder",
            kind=kind.value,
            now_s=now / 1e9,
            wall_time=self._clocks.iso(now),
            message=text,
            severity=severity,
            details=details,
        )
        self._add_json(Message(LOG_EVENTS, now, event.model_dump_json().encode()))

    def _report(self, now: int, at_once: bool = False) -> None:
        """Says which ticks the log will not have, at most once a second."""
        report = self._gaps.take(now, at_once)
        if report is None:
            return
        text, details = report
        log.warning("kind=recorder_lost lost=%s never_written=%s", details["lost"], details["never_written"])
        self._event(EventKind.RECORDER_LOST, text, "error" if details["lost"] else "warning", **details)

    def _wait(self) -> None:
        if self._waiting_since is None:
            self._waiting_since = self._monotonic()

    def _on_kernel(self, next_tick: int | None = None) -> None:
        """Everything that was added so far has reached the kernel."""
        self._control[Word.RECORDER_CURSOR] = self._reader.next_tick if next_tick is None else next_tick
        self._control[Word.RECORDER_STATE] = RecorderState.WRITING
        self._waiting_since = None
        self._backlog.clear()

    def _reopen(self, now: int) -> None:
        """Every second; after a full disk only when there is room for more than a few chunks."""
        if self._failed_ns is not None and now - self._failed_ns < RETRY_NS:
            return
        self._failed_ns = now
        if self._directory.exists():
            space = os.statvfs(self._directory)
            if space.f_bavail * space.f_frsize < MIN_FREE_BYTES:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.open()

    def _fail(self, error: OSError) -> None:
        """The file is given up; a new one is tried every second, from the cursor on."""
        self._control[Word.RECORDER_STATE] = RecorderState.FAILING
        path, file, self._file = self.path, self._file, None
        if file is not None:
            file.abandon()
        self._failed_ns = self._monotonic()
        self._waiting_since = None
        self._warnings.warn(self._failed_ns, "log_failed", f"file={path} errno={error.errno} error={error.strerror!r}")
