"""A recorder in this process, on a clock of the test's own."""

import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from axisync_schemas.cell import read_cell
from axisync_schemas.internal import LogEntry, RecorderStatus
from axisync_schemas.memory import RECORDER_BYTES, Control, Mailbox, Word
from axisync_schemas.replies import Event
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import TickLayout
from axisync_service.recorder.recorder import SECOND_NS, Recorder, SharedMemory
from support.feeder import Feeder
from support.logread import Log, logs_in, read_log
from support.recording import CELL

SLOTS = 1024
START_NS = 10**12


class Bench:
    """A recorder whose time passes only in `step`."""

    def __init__(
        self,
        directory: Path,
        slots: int = SLOTS,
        period: float | None = None,
        settings: dict[str, float] | None = None,
        plans: int = 64,
    ) -> None:
        """`settings`: of the cell file's [recorder], SI; `plans`: bytes of the region of plan slots."""
        cell, self._text = read_cell(CELL)
        changed = {"recorder": cell.recorder.model_copy(update=settings), "period": period or cell.period}
        self.cell = cell.model_copy(update=changed)
        self.plans = bytearray(plans)
        layout = TickLayout(len(self.cell.axes), len(self.cell.groups))
        self.control = Control(bytearray(Control.size(2)), 2)
        ring = TickRing(bytearray(TickRing.size(layout, slots)), layout, slots)
        self.feeder = Feeder(self.cell, self.control, ring, origin_ns=START_NS)
        self.now = START_NS
        self.writer, self._reader = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.writer.setblocking(False)
        self.directory = directory
        self.status = Mailbox(bytearray(RECORDER_BYTES))
        self._memory = SharedMemory(self.control, ring, self.plans, self.status)
        self.recorder = self.another()

    def another(self) -> Recorder:
        """A recorder on the same memory, as after a restart."""
        return Recorder(
            self.cell, self._text, self.directory, self._memory, [self._reader],
            monotonic=lambda: self.now, wall=lambda: self.now + 1_700_000_000 * SECOND_NS,
        )  # fmt: skip

    def close(self) -> None:
        if self.recorder.path is not None:
            self.recorder.close()
        self.writer.close()
        self._reader.close()

    def step(self, seconds: float = 0.02) -> None:
        self.now += round(seconds * SECOND_NS)
        while self.recorder.step():
            pass

    def run(self, first: int, last: int, per_step: int = 250) -> None:
        """Ticks first..last in their time, a step of the recorder each `per_step` of them."""
        for begin in range(first, last + 1, per_step):
            end = min(last, begin + per_step - 1)
            self.feeder.write(begin, end)
            self.now = START_NS + end * self.cell.period_ns
            self.step(0.0)

    def send(self, topic: str, **data: object) -> None:
        entry = LogEntry(topic=topic, log_time_ns=self.now, data=data)
        self.writer.send(entry.model_dump_json().encode())

    def event(self, kind: str, severity: str = "info", source: str = "controller") -> None:
        """An event, as another process sends it."""
        text = f"{kind} of the test"
        self.send(
            "/events", seq=0, source=source, kind=kind, message=text, wall_time="", now_s=self.now / 1e9,
            severity=severity, details={},
        )  # fmt: skip

    def said(self) -> list[Event]:
        """The recorder's own events, as front sees them."""
        payload = self.status.read()
        assert payload is not None
        return list(RecorderStatus.model_validate_json(payload).events)

    def log(self) -> Log:
        return read_log(*logs_in(self.directory))

    @property
    def state(self) -> int:
        return self.control[Word.RECORDER_STATE]

    @property
    def cursor(self) -> int:
        return self.control[Word.RECORDER_CURSOR]


@contextmanager
def made(directory: Path, **settings: Any) -> Iterator[Bench]:
    """An open one, closed at the end."""
    one = Bench(directory, **settings)
    try:
        one.recorder.open()
        yield one
    finally:
        one.close()


def no_space(*_: object) -> int:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
