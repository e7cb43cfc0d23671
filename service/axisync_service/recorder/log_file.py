"""One MCAP file (https://mcap.dev/spec) of a cell: its channels, attachments and metadata, and how it ends."""

import contextlib
import json
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer
from pydantic import BaseModel

from axisync_schemas import ticks_pb2
from axisync_schemas.cell import Cell
from axisync_schemas.log_models import PlanLog, RequestLog
from axisync_schemas.replies import Event
from axisync_schemas.ticks import file_descriptor_set
from axisync_schemas.topics import LOG_EVENTS, LOG_PLANS, LOG_REQUESTS, LOG_SETPOINTS
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.kernel_file import KernelFile, sync_directory
from axisync_service.recorder.versions import versions_json

CHUNK_BYTES = 64 * 1024
"""Before compression: 0.18 s of 12 axes at 500 Hz."""
COMPRESSION = CompressionType.ZSTD
"""Against lz4, a tenth to a quarter less on disk for 0.15 % more of a core at 500 Hz."""

JSON_TOPICS: dict[str, type[BaseModel]] = {LOG_REQUESTS: RequestLog, LOG_PLANS: PlanLog, LOG_EVENTS: Event}


def new_file(directory: Path, cell: str, clocks: ClockPair) -> KernelFile:
    """`<cell>_<yyyymmddThhmmssZ>.mcap`, with _2, _3... where that exists.

    Raises:
        OSError: it cannot be made.
    """
    number = 1
    while True:
        suffix = "" if number == 1 else f"_{number}"
        try:
            return KernelFile(directory / f"{cell}_{clocks.stamp()}{suffix}.mcap")
        except FileExistsError:
            number += 1


class LogFile:
    """An open log. After an OSError from any method only `abandon` may follow."""

    def __init__(self, directory: Path, cell: Cell, cell_text: str, clocks: ClockPair) -> None:
        """
        Raises:
            OSError: the file cannot be made or written.
        """
        self.clocks = clocks
        self._file = new_file(directory, cell.name, clocks)
        self.path = self._file.path
        self._empty = True
        try:
            self._begin(cell, cell_text)
            sync_directory(directory)
        except OSError:
            self.abandon()
            raise
        self._kernel = self._file.position

    def _begin(self, cell: Cell, cell_text: str) -> None:
        self._writer = Writer(cast(IO[Any], self._file), chunk_size=CHUNK_BYTES, compression=COMPRESSION)
        self._writer.start(profile="axisync")
        self._writer.add_metadata("axisync.clocks", self.clocks.metadata())
        now = self.clocks.wall_ns
        self._writer.add_attachment(now, now, "cell.toml", "application/toml", cell_text.encode())
        self._writer.add_attachment(now, now, "versions.json", "application/json", versions_json())
        self._sequences = dict.fromkeys(JSON_TOPICS, 0)
        self._setpoints = self._setpoint_channel(cell)
        self._json = {topic: self._json_channel(topic, model) for topic, model in JSON_TOPICS.items()}

    def _setpoint_channel(self, cell: Cell) -> int:
        name = ticks_pb2.SetpointTick.DESCRIPTOR.full_name
        schema = self._writer.register_schema(name, "protobuf", file_descriptor_set())
        labels = {
            "axes": " ".join(axis.name for axis in cell.axes),
            "groups": " ".join(cell.group_names),
            "period_ns": str(cell.period_ns),
        }
        return self._writer.register_channel(LOG_SETPOINTS, "protobuf", schema, labels)

    def _json_channel(self, topic: str, model: type[BaseModel]) -> int:
        schema = json.dumps(model.model_json_schema(mode="serialization")).encode()
        return self._writer.register_channel(
            topic, "json", self._writer.register_schema(f"axisync.{model.__name__}", "jsonschema", schema)
        )

    def add_tick(self, record: bytes, tick: int, cycle_start_ns: int) -> bool:
        """Adds a record; True when a chunk has just reached the kernel, with all that was added so far.

        Raises:
            OSError: a chunk could not be written.
        """
        wall = self.clocks.wall(cycle_start_ns)
        self._writer.add_message(self._setpoints, wall, record, wall, tick & 0xFFFFFFFF)
        return self._reached()

    def add_json(self, topic: str, log_time_ns: int, payload: bytes) -> bool:
        """Adds a message of a topic of `JSON_TOPICS`, at a monotonic instant; returns and raises as `add_tick`."""
        wall = self.clocks.wall(log_time_ns)
        self._sequences[topic] += 1
        self._writer.add_message(self._json[topic], wall, payload, wall, self._sequences[topic])
        return self._reached()

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
