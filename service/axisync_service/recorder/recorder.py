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
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import RecorderState
from axisync_schemas.events import EventKind
from axisync_schemas.log_models import LogLine
from axisync_schemas.memory import Control, Mailbox, Word
from axisync_schemas.tick_ring import TickRing
from axisync_service.recorder.backlog import Backlog
from axisync_service.recorder.clocks import ClockPair, NanosecondClock, measure
from axisync_service.recorder.entries import Entries, Message
from axisync_service.recorder.extracts import Extracts
from axisync_service.recorder.gaps import Gap, GapReport
from axisync_service.recorder.log_file import LogFile
from axisync_service.recorder.plans_again import plans_in, recovered
from axisync_service.recorder.rate_limit import RateLimited
from axisync_service.recorder.retention import tidy
from axisync_service.recorder.ring_reader import RingReader
from axisync_service.recorder.voice import Lines, Severity, Voice, line_message

SECOND_NS = 1_000_000_000
FLUSH_NS = 900_000_000
"""A message waits at most this long for its chunk to fill, and so reaches the kernel within a second."""
SYNC_NS = SECOND_NS
SLOW_SYNC_S = 1.0
RETRY_NS = SECOND_NS
TIDY_NS = 10 * SECOND_NS
MIN_FREE_BYTES = 4 * 1024 * 1024
LINES_KEPT = 200

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SharedMemory:
    """What the recorder reads, and says, in shared memory; `status` is its own mailbox."""

    control: Control
    ring: TickRing
    plans: mmap.mmap | bytearray
    status: Mailbox


class Recorder:
    """One cell's recorder; `open` once, `step` every 20 ms or so, `close` at the end."""

    def __init__(
        self,
        cell: Cell,
        cell_text: str,
        directory: Path,
        memory: SharedMemory,
        sockets: Sequence[socket.socket],
        monotonic: NanosecondClock = time.monotonic_ns,
        wall: NanosecondClock = time.time_ns,
    ) -> None:
        self._cell, self._cell_text, self._directory = cell, cell_text, directory
        self._memory, self._control = memory, memory.control
        self._reader = RingReader(memory.control, memory.ring)
        self._entries = Entries(sockets, memory.plans)
        self._backlog = Backlog()
        self._monotonic, self._wall = monotonic, wall
        self._cycle_start = struct.Struct("<Q"), memory.ring.layout.offset("cycle_start_ns")
        self._warnings = RateLimited(log)
        self._voice, self._event_lines = Voice(memory.status), Lines()
        self._lines: deque[LogLine] = deque(maxlen=LINES_KEPT)
        self._gaps = GapReport()
        self._missed_until = 0
        self._file: LogFile | None = None
        self._clocks: ClockPair = measure(monotonic, wall)
        self._opened_ns = self._synced_ns = self._tidied_ns = 0
        self._realtime_noted = False
        self._failed_ns: int | None = None
        self._failed_why = ""
        self._waiting_since: int | None = None
        self._plans: dict[str, Message] = {}
        self._extracts = Extracts(directory, cell, cell_text)
        self._look_back()

    @property
    def path(self) -> Path | None:
        """The file being written."""
        return self._file.path if self._file else None

    @property
    def _name(self) -> str | None:
        return self._file.path.name if self._file else None

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
        self._realtime_noted = False
        if self._reader.newest:
            self._note_realtime(self._file)
        if self._control[Word.RECORDER_STATE] == RecorderState.NOT_STARTED:
            self._control[Word.RECORDER_STATE] = RecorderState.WRITING
        log.info("kind=log_opened file=%s next_tick=%d", self._file.path, self._reader.next_tick)
        waiting = list(self._backlog)
        self._backlog.clear()
        for message in [plan for plan in self._plans.values() if plan not in waiting] + waiting:
            self._put(message)
        self._event(EventKind.LOG_OPENED, "the log is open", file=self._name, tick=self._reader.next_tick)

    def step(self) -> bool:
        """One round; True where more waits already. Errors of the file are dealt with here."""
        now = self._monotonic()
        self._control[Word.RECORDER_NS] = now
        more = self._take_entries(now)
        self._take_lines(now)
        try:
            if self._file is None:
                self._reopen(now)
            behind = self._take_ticks()
            self._keep_times(now)
            if not behind and self._file is not None:
                self._write_extracts(now)
            more = behind or more
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
        self._write_extracts(self._monotonic(), all_of_them=True)
        if self._finish():
            return True
        log.error("kind=log_incomplete ticks=%d messages=%d", self._reader.behind, len(self._backlog))
        return False

    def _finish(self) -> bool:
        self._report(self._monotonic(), at_once=True)
        self._event(EventKind.LOG_CLOSED, "the log ends here", file=self._name, tick=self._reader.next_tick)
        file = self._file
        if file is None:
            return False
        try:
            file.finish()
        except OSError as error:
            self._fail(error)
            return False
        self._file = None
        self._on_kernel()
        log.info("kind=log_closed file=%s next_tick=%d", file.path, self._reader.next_tick)
        return True

    def _take_entries(self, now: int) -> bool:
        received = self._entries.receive()
        for problem in received.problems:
            self._warnings.warn(now, "entry", f"problem={problem!r}")
        for message in received.messages:
            self._add(message)
            line = self._event_lines.of(message, self._clocks)
            if line is not None:
                self._add(line)
        return received.more

    def add_line(self, line: LogLine, _wall_ns: int = 0) -> None:
        """A line of this process's own; it waits for the next step."""
        self._lines.append(line)

    def _take_lines(self, now: int) -> None:
        while self._lines:
            self._add(line_message(self._lines.popleft(), now))

    def _take_ticks(self) -> bool:
        if self._reader.restarted():
            log.warning("kind=ticks_anew newest=%d", self._reader.newest)
            self._missed_until = 0
            self._rotate()
        if self._file is None:
            return False
        records, gaps = self._reader.read()
        if records:
            self._note_realtime(self._file)
        code, offset = self._cycle_start
        for tick, record in records:
            self._wait()
            (start_ns,) = code.unpack_from(record, offset)
            self._extracts.recent.add_tick(tick, start_ns, record)
            if self._file is None:  # An event found it broken.
                return False
            if self._file.add_tick(record, tick, start_ns):
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
        if self._file is not None and now - self._synced_ns >= SYNC_NS:
            self._synced_ns = begun = self._monotonic()
            self._file.sync()
            took_s = (self._monotonic() - begun) / SECOND_NS
            if took_s > SLOW_SYNC_S:
                self._warnings.warn(now, "slow_sync", f"seconds={took_s:.1f} behind={self._reader.behind}")
        if self._full(now):
            self._rotate()
        if now - self._tidied_ns >= TIDY_NS:
            self._tidied_ns = now
            self._tidy()

    def _full(self, now: int) -> bool:
        """It is time for a new file, or the file is large enough."""
        settings = self._cell.recorder
        if self._file is None:
            return False
        return now - self._opened_ns >= settings.rotate_after * SECOND_NS or self._file.size >= settings.rotate_size

    def _rotate(self) -> None:
        if self._finish():
            self.open()

    def _add(self, message: Message) -> None:
        """A new message; never raises."""
        self._extracts.add(message)
        self._put(message)

    def _put(self, message: Message) -> None:
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
        self._add(self._voice.event(self._monotonic(), self._clocks, self._name, kind, text, severity, details))

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
        self._waiting_since = None
        self._backlog.clear()
        again = self._control[Word.RECORDER_STATE] == RecorderState.FAILING
        self._control[Word.RECORDER_STATE] = RecorderState.WRITING
        if again:
            why = self._failed_why or "a restart"
            self._event(EventKind.RECORDER_RECOVERED, f"the log is written again, after: {why}", file=self._name)

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
        path, file, self._file = self.path, self._file, None
        if file is not None:
            file.abandon()
        self._failed_ns = self._monotonic()
        self._waiting_since = None
        self._warnings.warn(self._failed_ns, "log_failed", f"file={path} errno={error.errno} error={error.strerror!r}")
        self.failing(error)

    def failing(self, error: OSError) -> None:
        """Says, once, that the log cannot be written."""
        if self._control[Word.RECORDER_STATE] == RecorderState.FAILING:
            return
        self._control[Word.RECORDER_STATE] = RecorderState.FAILING
        self._failed_why = error.strerror or repr(error)
        text = f"the log cannot be written into {self._directory}: {self._failed_why}"
        self._event(EventKind.RECORDER_FAILING, text, "error", reason=self._failed_why, errno=error.errno)

    # --- beside the log -----------------------------------------------------------------------------------------

    def _look_back(self) -> None:
        """A recorder that was started anew knows what the ring and the plan slots still tell."""
        newest, ring = self._reader.newest, self._memory.ring
        now = self._monotonic()
        code, offset = self._cycle_start
        for tick in range(max(1, newest - ring.slots + 1), self._reader.next_tick):
            record = ring.read(tick)
            if record is not None:
                self._extracts.recent.add_tick(tick, code.unpack_from(record, offset)[0], record)
        playing = plans_in(ring, self._cell, self._reader.next_tick - 1, newest)
        for message in recovered(self._memory.plans, playing, now):
            self._plans[str(message.group)] = message

    def _note_realtime(self, file: LogFile) -> None:
        """Once a file, when the controller runs and knows."""
        if not self._realtime_noted:
            self._realtime_noted = True
            permitted = self._control[Word.REALTIME] == 1
            file.add_metadata("axisync.realtime", {"controller": "SCHED_FIFO" if permitted else "not permitted"})

    def _write_extracts(self, now: int, all_of_them: bool = False) -> None:
        faults = self._extracts.faults
        for fault in faults.due(now, all_of_them):
            try:
                path = self._extracts.write(fault, self._clocks, self._plans.values())
            except OSError as error:
                self._warnings.warn(now, "extract_failed", f"fault={fault.what} error={error.strerror!r}")
                continue
            left_out, faults.left_out = faults.left_out, 0
            text = f"what happened around {fault.what} is in {path.parent.name}/{path.name}"
            self._event(EventKind.LOG_EXTRACT, text, file=path.name, fault=fault.what, left_out=left_out)

    def _tidy(self) -> None:
        deleted = tidy(self._directory, self._cell.name, self._cell.recorder.keep)
        if deleted:
            names = [str(kept.name) for kept in deleted]
            log.info("kind=log_deleted files=%s", ",".join(names))
            text = f"{len(names)} old log files deleted: {self._cell.recorder.keep / 1e9:g} GB are kept"
            self._event(EventKind.LOG_DELETED, text, files=names[:16], more=max(0, len(names) - 16))
