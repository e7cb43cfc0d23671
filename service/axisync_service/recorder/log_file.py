"""One MCAP file (https://mcap.dev/spec) of a cell: its channels, attachments and metadata, and how it ends."""

import contextlib
import fcntl
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer

from axisync_schemas.cell import Cell
from axisync_schemas.joint_states import JointStates
from axisync_schemas.log_channels import channels, labels
from axisync_schemas.ticks import TickLayout
from axisync_schemas.topics import LOG_JOINT_STATES, LOG_SETPOINTS
from axisync_service.recorder.attachments import attachments
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.kernel_file import KernelFile, sync_directory
from axisync_service.recorder.names import LogName
from axisync_service.recorder.versions import machine

CHUNK_BYTES = 64 * 1024
"""Before compression: 0.18 s of 12 axes at 500 Hz."""
COMPRESSION = CompressionType.ZSTD
"""Against lz4, a tenth to a quarter less on disk for 0.15 % more of a core at 500 Hz."""


def new_file(directory: Path, cell: str, clocks: ClockPair, fault: str = "") -> KernelFile:
    """A file of a name that is not taken yet; locked, so that nobody tidies it away while it is written.

    Raises:
        OSError: it cannot be made.
    """
    number = 1
    while True:
        path = LogName(clocks.stamp(), number, cell, fault).path(directory)
        try:
            file = KernelFile(path)
        except FileExistsError:
            number += 1
            continue
        with contextlib.suppress(OSError):  # A file system without locks.
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        return file


class LogFile:
    """An open log. After an OSError from any method only `abandon` may follow."""

    def __init__(self, directory: Path, cell: Cell, cell_text: str, clocks: ClockPair, fault: str = "") -> None:
        """`fault`: what the file is an extract around; "" for the log itself.

        Raises:
            OSError: the file cannot be made or written.
        """
        self.clocks = clocks
        self._file = new_file(directory, cell.name, clocks, fault)
        self.path = self._file.path
        self._empty = True
        self._joint_states = JointStates(cell, TickLayout(len(cell.axes), len(cell.groups)))
        try:
            self._begin(cell, cell_text)
            sync_directory(self.path.parent)
        except OSError:
            self.abandon()
            raise
        self._kernel = self._file.position

    @property
    def size(self) -> int:
        """Bytes that have reached the kernel."""
        return self._file.position

    def _begin(self, cell: Cell, cell_text: str) -> None:
        self._writer = Writer(cast(IO[Any], self._file), chunk_size=CHUNK_BYTES, compression=COMPRESSION)
        self._writer.start(profile="axisync")
        self._writer.add_metadata("axisync.clocks", self.clocks.metadata())
        self._writer.add_metadata("axisync.machine", machine())
        now = self.clocks.wall_ns
        for one in attachments(cell, cell_text):
            self._writer.add_attachment(now, now, one.name, one.media_type, one.data)
        self._channels = self._register(cell)
        self._sequences = dict.fromkeys(self._channels, 0)
        self._setpoints = self._channels[LOG_SETPOINTS]

    def _register(self, cell: Cell) -> dict[str, int]:
        registered = {}
        for one in channels():
            schema = self._writer.register_schema(one.name, one.schema_encoding, one.schema)
            given = labels(cell) if one.topic == LOG_SETPOINTS else {}
            registered[one.topic] = self._writer.register_channel(one.topic, one.encoding, schema, given)
        return registered

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Adds a metadata record, at once.

        Raises:
            OSError: it could not be written.
        """
        self._writer.add_metadata(name, values)
        self._kernel = self._file.position  # The record, but no chunk, has reached it.

    def add_tick(self, record: bytes, tick: int, cycle_start_ns: int) -> bool:
        """Adds a record; True when a chunk has just reached the kernel, with all that was added so far.

        Raises:
            OSError: a chunk could not be written.
        """
        wall = self.clocks.wall(cycle_start_ns)
        self._writer.add_message(self._setpoints, wall, record, wall, tick & 0xFFFFFFFF)
        joints = self._joint_states.message(tick, record, wall)
        if joints is not None:
            self._add(LOG_JOINT_STATES, wall, joints)
        return self._reached()

    def add_json(self, topic: str, log_time_ns: int, payload: bytes) -> bool:
        """Adds a message of a topic of `JSON_TOPICS`, at a monotonic instant; returns and raises as `add_tick`."""
        self._add(topic, self.clocks.wall(log_time_ns), payload)
        return self._reached()

    def _add(self, topic: str, wall_ns: int, payload: bytes) -> None:
        self._sequences[topic] += 1
        self._writer.add_message(self._channels[topic], wall_ns, payload, wall_ns, self._sequences[topic])

    def flush(self) -> bool:
        """Ends the chunk, however small; returns and raises as `add_tick`."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        return self._reached()

    def _reached(self) -> bool:
        if self._file.position == self._kernel:
            return False
        self._kernel = self._file.position
        self._empty = False
        return True

    def sync(self) -> None:
        """Has the kernel bring it to the disk.

        Raises:
            OSError: it could not.
        """
        self._file.sync()

    def finish(self) -> None:
        """Writes the last chunk and the summary, syncs and closes.

        Raises:
            OSError: it could not; `abandon` then keeps what is whole.
        """
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._reached()
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.sync()
        self._file.close()

    def abandon(self) -> None:
        """After an error: cuts the file after its last whole chunk, or removes it where it has none. Never raises."""
        with contextlib.suppress(OSError):
            if self._empty:
                self.path.unlink()
            else:
                self._file.cut(self._kernel)
        with contextlib.suppress(OSError):
            self._file.close()
