"""The end of an MCAP file, its Summary Section: how a reader finds its way, made anew from what was copied."""

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from axisync_review.container import MAGIC


@dataclass(slots=True)
class Summary:
    """Gathered while the records before it are written."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)

    def write(self, stream: BinaryIO) -> None:
        """DataEnd, the summary and its offsets, the footer and the end mark."""
        builder = RecordBuilder()
        DataEnd(0).write(builder)
        stream.write(taken(builder))
        begin = stream.tell()
        offsets = []
        for opcode, records in self._groups():
            group = begin + builder.count
            for record in records:
                record.write(builder)
            offsets.append(SummaryOffset(opcode, group, begin + builder.count - group))
        offset_begin = begin + builder.count
        for offset in offsets:
            offset.write(builder)
        data = taken(builder)
        head = struct.pack("<BQQQ", Opcode.FOOTER, 8 + 8 + 4, begin, offset_begin)
        Footer(begin, offset_begin, zlib.crc32(head, zlib.crc32(data))).write(builder)
        stream.write(data + taken(builder) + MAGIC)

    def _groups(self) -> list[tuple[int, Sequence[McapRecord]]]:
        groups: list[tuple[int, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, list(self.schemas.values())),
            (Opcode.CHANNEL, list(self.channels.values())),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self.chunks),
            (Opcode.ATTACHMENT_INDEX, self.attachments),
            (Opcode.METADATA_INDEX, self.metadata),
        ]
        return [(opcode, records) for opcode, records in groups if records]

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self.counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.counts.values()),
            message_end_time=max((chunk.message_end_time for chunk in self.chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self.chunks), default=0),
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )


def taken(builder: RecordBuilder) -> bytes:
    """What was built; the builder is empty afterwards."""
    built: bytes = builder.end()  # type: ignore[no-untyped-call]
    return built
