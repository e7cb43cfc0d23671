"""One log file: what heads it, and its ticks and messages in the order in which they were written."""

import fcntl
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema
from numpy.typing import NDArray

from axisync_review.chunks import MESSAGE_HEAD, DamagedChunk, Other, Run, unpack, walk
from axisync_review.container import Container, Damage, Frame, body_stream
from axisync_review.errors import LogUnreadable, foreign
from axisync_schemas.cell import Cell, CellError, parse_cell
from axisync_schemas.ticks import TickLayout, file_descriptor_set
from axisync_schemas.topics import LOG_JOINT_STATES, LOG_SETPOINTS

PROFILE = "axisync"
MALFORMED = (McapError, struct.error, UnicodeDecodeError, DecodeError, EOFError, ValueError)
"""What reading a record's body raises where it is not what its opcode says."""

DERIVED = frozenset({LOG_JOINT_STATES})
"""Topics that say again what the ticks say; they are left out."""

Rows = NDArray[np.void]
"""Messages of `/setpoints` as they lie in a chunk: fields `log_time` (wall, ns) and `record` (`TickLayout.dtype`)."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message of another topic; `log_time_ns` is wall time."""

    topic: str
    log_time_ns: int
    payload: bytes


@dataclass(slots=True)
class Heading:
    """What a file says about itself.

    Attributes:
        row: type of `Rows`.
        offset_ns: wall minus monotonic time, one for the whole file; None where it is not said.
        versions: of Python, axisync and libraries, as JSON.
    """

    cell: Cell
    cell_text: str
    layout: TickLayout
    row: np.dtype[np.void]
    offset_ns: int | None = None
    versions: bytes = b"{}"


def begin_ns(path: Path) -> int:
    """Wall time at which a file was opened, as its beginning says; 0 where it does not.

    Raises:
        LogUnreadable: not an MCAP file.
    """
    with Container(path) as container:
        for frame in container:
            if frame.opcode not in (Opcode.HEADER, Opcode.METADATA):
                break
            if frame.opcode == Opcode.METADATA:
                try:
                    return int(Metadata.read(body_stream(frame.body)).metadata.get("wall_ns", "0"))
                except MALFORMED:
                    break
    return 0


def being_written(path: Path) -> bool:
    """A recorder holds a lock on the file that it writes."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def row_type(layout: TickLayout) -> np.dtype[np.void]:
    """A message of `/setpoints` with its head."""
    return np.dtype(
        [("head", "V11"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8"), ("record", layout.dtype)]
    )


@dataclass(slots=True)
class LogFile:
    """Reads one file. Iterate once; `heading` is there from the first chunk on, `damage` at the end.

    Attributes:
        dropped: chunks in the middle that were damaged; the ticks in them are gone.
    """

    path: Path
    heading: Heading | None = None
    damage: Damage | None = None
    dropped: list[Damage] = field(default_factory=list)
    size: int = 0
    position: int = 0
    _channels: dict[int, Channel] = field(default_factory=dict)
    _schemas: dict[int, Schema] = field(default_factory=dict)
    _metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    _attachments: dict[str, bytes] = field(default_factory=dict)

    def parts(self, ticks: bool = True) -> Iterator[memoryview | Message]:
        """Bytes of `Rows`, many at once, and messages of other topics. `ticks=False` leaves the ticks out.

        Raises:
            LogUnreadable: not a log of axisync, or not one that this version can read.
        """
        with Container(self.path) as container:
            self.size = container.size
            for frame in container:
                self.position = frame.end
                if frame.opcode == Opcode.DATA_END:
                    continue
                yield from self._frame(frame, ticks)
            self.damage = container.damage
        self.head()

    def head(self) -> Heading:
        """The heading.

        Raises:
            LogUnreadable: the file has none.
        """
        if self.heading is None:
            text = self._attachments.get("cell.toml")
            if text is None:
                raise LogUnreadable(f"{self.path} holds nothing that can be read: it ends before its cell file")
            self.heading = self._make_heading(text)
        return self.heading

    def _frame(self, frame: Frame, ticks: bool) -> Iterator[memoryview | Message]:
        try:
            if frame.opcode == Opcode.HEADER:
                self._header(Header.read(body_stream(frame.body)))
            elif frame.opcode == Opcode.ATTACHMENT:
                attachment = Attachment.read(body_stream(frame.body))
                self._attachments[attachment.name] = attachment.data
            elif frame.opcode == Opcode.METADATA:
                metadata = Metadata.read(body_stream(frame.body))
                self._metadata[metadata.name] = dict(metadata.metadata)
            elif frame.opcode == Opcode.CHUNK:
                yield from self._chunk(unpack(frame.body), ticks)
        except MALFORMED as error:
            if isinstance(error, LogUnreadable):
                raise
            self.dropped.append(Damage(frame.offset, str(error) or f"a record that is not whole ({frame.opcode:#x})"))

    def _header(self, header: Header) -> None:
        if header.profile != PROFILE:
            raise foreign(self.path, header.profile)

    def _chunk(self, data: bytes, ticks: bool) -> Iterator[memoryview | Message]:
        heading = self.head()
        octets, size = memoryview(data), heading.row.itemsize
        for part in walk(data):
            if isinstance(part, Other):
                self._declare(part.opcode, data[part.begin : part.end])
                continue
            channel = self._channels.get(part.channel)
            if channel is None:
                raise DamagedChunk(f"messages of channel {part.channel}, which is not declared")
            topic = channel.topic
            if topic == LOG_SETPOINTS:
                if part.length != size:
                    raise self._other_size(part, heading)
                if ticks:
                    yield octets[part.begin : part.begin + part.messages * size]
            elif topic not in DERIVED:
                yield from _messages(topic, data, part)

    def _declare(self, opcode: int, body: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(body_stream(body))
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(body_stream(body))
            self._channels[channel.id] = channel
            schema_of = self._schemas.get(channel.schema_id)
            if channel.topic == LOG_SETPOINTS and schema_of is not None:
                _check_record(self.path, schema_of.data)

    def _other_size(self, run: Run, heading: Heading) -> LogUnreadable:
        size = run.length - MESSAGE_HEAD.size
        return LogUnreadable(
            f"{self.path} has ticks of {size} bytes, where those of its cell file have {heading.layout.size}"
        )

    def _make_heading(self, text: bytes) -> Heading:
        try:
            cell, layout, row = _parsed(text.decode())
        except (CellError, UnicodeDecodeError) as error:
            first = str(error).splitlines()[0]
            raise LogUnreadable(f"the cell file in {self.path} is not one that this version reads: {first}") from None
        offset = self._metadata.get("axisync.clocks", {}).get("offset_ns", "")
        return Heading(
            cell=cell,
            cell_text=text.decode(),
            layout=layout,
            row=row,
            offset_ns=int(offset) if offset.lstrip("-").isdigit() else None,
            versions=self._attachments.get("versions.json", b"{}"),
        )


@lru_cache(maxsize=4)
def _parsed(text: str) -> tuple[Cell, TickLayout, "np.dtype[np.void]"]:
    """The files of a run have the same cell file, and each is read more than once."""
    cell = parse_cell(text, "cell.toml")
    layout = TickLayout(len(cell.axes), len(cell.groups))
    return cell, layout, row_type(layout)


def _messages(topic: str, data: bytes, run: Run) -> Iterator[Message]:
    for begin in range(run.begin, run.begin + run.messages * run.length, run.length):
        log_time = MESSAGE_HEAD.unpack_from(data, begin)[4]
        yield Message(topic, log_time, data[begin + MESSAGE_HEAD.size : begin + run.length])


def _fields(descriptors: bytes) -> list[tuple[str, int, int]]:
    """Name, number and type of each field of SetpointTick."""
    files = FileDescriptorSet.FromString(descriptors)
    found: list[Any] = [message for file in files.file for message in file.message_type]
    return [(f.name, f.number, f.type) for message in found if message.name == "SetpointTick" for f in message.field]


def _check_record(path: Path, schema: bytes) -> None:
    """A log of another version may have other fields in its ticks.

    Raises:
        LogUnreadable: it has.
    """
    theirs, ours = _fields(schema), _fields(file_descriptor_set())
    if theirs != ours:
        differ = sorted({name for name, _, _ in set(theirs) ^ set(ours)})
        raise LogUnreadable(
            f"{path} was written by another version of axisync, whose ticks differ in {', '.join(differ) or 'order'}",
            "read it with that version, which versions.json in the file names",
        )
