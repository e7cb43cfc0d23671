"""A log that was cut becomes a valid one: whole records are copied, indexes and summary are made anew."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Header,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
)

from axisync_review.chunks import DamagedChunk, Other, Run, unpack, walk
from axisync_review.container import HEAD, MAGIC, Container, Frame, body_stream
from axisync_review.errors import LogUnreadable, NotWritten, foreign
from axisync_review.log_file import MALFORMED, PROFILE
from axisync_review.summary import Summary, taken
from axisync_schemas.base import Strict
from axisync_schemas.topics import LOG_SETPOINTS

DATA = (Opcode.HEADER, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.CHUNK)
"""Records that are copied; indexes are made anew, the rest belongs to the summary."""


class Recovery(Strict):
    """What became of a log.

    Attributes:
        was_whole: nothing was lost; the copy has the same records.
        lost_bytes: behind the last whole record, or in damaged chunks.
        ticks, messages: how many the new file has, ticks among the messages.
        lost: what is missing now, in words.
    """

    path: str
    was_whole: bool
    ticks: int
    messages: int
    last_tick: int | None
    lost_bytes: int
    lost: tuple[str, ...]


def recover(path: Path, out: Path, progress: Callable[[int, int], None] | None = None) -> Recovery:
    """Writes `out`, which must not exist; it appears under its name when it is whole.

    Raises:
        LogUnreadable: not a log, or nothing in it is whole.
        NotWritten: `out` exists or cannot be written.
    """
    if out.exists():
        raise NotWritten(f"{out} exists already", "name another file with -o")
    part = out.with_name(out.name + ".part")
    try:
        with Container(path) as container, part.open("xb") as stream:
            recovery = _copy(container, stream, progress)
            stream.flush()
            os.fsync(stream.fileno())
        part.rename(out)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise NotWritten(f"{out} cannot be written: {error.strerror or error}") from None
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return recovery


def _copy(container: Container, stream: BinaryIO, progress: Callable[[int, int], None] | None) -> Recovery:
    copier = Copier(container.path, stream)
    stream.write(MAGIC)
    for frame in container:
        if frame.opcode == Opcode.DATA_END:
            copier.ended = True
        if frame.opcode in DATA and not copier.ended:
            copier.take(frame)
        if progress is not None and frame.opcode == Opcode.CHUNK:
            progress(frame.end, container.size)
    if not copier.summary.chunks:
        raise LogUnreadable(f"{container.path} has no whole chunk: nothing can be recovered")
    copier.summary.write(stream)
    damage = container.damage
    if damage is not None and not copier.ended:
        rest = container.size - damage.offset
        copier.lost_bytes += rest
        copier.lost.append(f"the last {rest:,} bytes, after byte {damage.offset:,}: {damage.text}")
    return copier.result(container.damage is None)


@dataclass(slots=True)
class Copier:
    """Copies records and gathers their summary. `ended`: the data section is over."""

    path: Path
    stream: BinaryIO
    summary: Summary = field(default_factory=Summary)
    lost: list[str] = field(default_factory=list)
    lost_bytes: int = 0
    ended: bool = False
    _last_tick: int | None = None

    def take(self, frame: Frame) -> None:
        """Copies one record, or says why not."""
        try:
            if frame.opcode == Opcode.HEADER:
                self._header(frame)
            elif frame.opcode == Opcode.CHUNK:
                self._chunk(frame)
            else:
                self._aside(frame)
        except LogUnreadable:
            raise
        except MALFORMED as error:
            self.lost_bytes += len(frame.body)
            self.lost.append(f"the record at byte {frame.offset:,}: {error or 'not whole'}")

    def result(self, was_whole: bool) -> Recovery:
        """What became of it."""
        ticks = sum(
            count for channel, count in self.summary.counts.items()
            if channel in self.summary.channels and self.summary.channels[channel].topic == LOG_SETPOINTS
        )  # fmt: skip
        return Recovery(
            path=self.stream.name.removesuffix(".part"),
            was_whole=was_whole and not self.lost,
            ticks=ticks,
            messages=sum(self.summary.counts.values()),
            last_tick=self._last_tick,
            lost_bytes=self.lost_bytes,
            lost=tuple(self.lost),
        )

    def _header(self, frame: Frame) -> None:
        profile = Header.read(body_stream(frame.body)).profile
        if profile != PROFILE:
            raise foreign(self.path, profile)
        self._write(frame)

    def _aside(self, frame: Frame) -> None:
        """Attachments and metadata."""
        length = HEAD.size + len(frame.body)
        if frame.opcode == Opcode.METADATA:
            name = Metadata.read(body_stream(frame.body)).name
            self.summary.metadata.append(MetadataIndex(self._write(frame), length, name))
            return
        one = Attachment.read(body_stream(frame.body))
        self.summary.attachments.append(
            AttachmentIndex(
                self._write(frame), length, one.log_time, one.create_time, len(one.data), one.name, one.media_type
            )
        )

    def _write(self, frame: Frame) -> int:
        """Copies the record; where it begins now."""
        at = self.stream.tell()
        self.stream.write(HEAD.pack(frame.opcode, len(frame.body)) + frame.body)
        return at

    def _chunk(self, frame: Frame) -> None:
        """Copies a chunk as it is, and indexes its messages."""
        data = unpack(frame.body)
        indexes: dict[int, list[tuple[int, int]]] = {}
        for part in walk(data):
            if isinstance(part, Run):
                if part.channel not in self.summary.channels:
                    raise DamagedChunk(f"messages of channel {part.channel}, which is not declared")
                indexes.setdefault(part.channel, []).extend(self._times(data, part))
            else:
                self._declare(data, part)
        begin = self._write(frame)
        end = self.stream.tell()
        builder, offsets = RecordBuilder(), {}
        for channel, entries in indexes.items():
            offsets[channel] = end + builder.count
            MessageIndex(channel, entries).write(builder)
            self.summary.counts[channel] = self.summary.counts.get(channel, 0) + len(entries)
        written = taken(builder)
        self.stream.write(written)
        chunk = Chunk.read(body_stream(frame.body))
        self.summary.chunks.append(
            ChunkIndex(
                chunk_length=end - begin,
                chunk_start_offset=begin,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=len(written),
                message_index_offsets=offsets,
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _times(self, data: bytes, run: Run) -> list[tuple[int, int]]:
        """(log time, offset in the chunk) of each message of a run."""
        rows = np.frombuffer(data, np.uint8, run.messages * run.length, run.begin).reshape(run.messages, run.length)
        times = np.ascontiguousarray(rows[:, 15:23]).view("<u8")[:, 0].tolist()
        if self.summary.channels[run.channel].topic == LOG_SETPOINTS:
            self._last_tick = int(np.ascontiguousarray(rows[-1, 11:15]).view("<u4")[0])
        return list(zip(times, range(run.begin, run.begin + run.messages * run.length, run.length), strict=True))

    def _declare(self, data: bytes, part: Other) -> None:
        body = data[part.begin : part.end]
        if part.opcode == Opcode.SCHEMA:
            schema = Schema.read(body_stream(body))
            self.summary.schemas[schema.id] = schema
        elif part.opcode == Opcode.CHANNEL:
            channel = Channel.read(body_stream(body))
            self.summary.channels[channel.id] = channel
