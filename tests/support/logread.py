"""Reads logs as a stranger would: MCAP files, whole or cut anywhere, of one run of the service."""

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, McapRecord, Metadata
from mcap.stream_reader import StreamReader

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.ticks import Records, TickLayout
from axisync_schemas.topics import LOG_EVENTS, LOG_LINES, LOG_PLANS, LOG_REQUESTS, LOG_SETPOINTS

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_OVERHEAD = 2 + 4 + 8 + 8
OTHER = ""
"""Stands for topics in an encoding that is not read here."""


class LogError(AssertionError):
    """A log that is worse than cut short."""


@dataclass(frozen=True, slots=True)
class JsonMessage:
    """One message of a JSON topic; `log_time_ns` is wall time."""

    log_time_ns: int
    data: dict[str, Any]


@dataclass(slots=True)
class Log:
    """What one or more files of one run hold.

    Attributes:
        ticks: structured records of `layout`, by tick, each once; a tick written twice must be the same twice.
        log_times_ns: [len(ticks)] wall times as the messages carry them.
        duplicates: ticks that came more than once (the recorder was killed between a chunk and its cursor).
        events, requests, lines: in the order of the files; plans: by plan_id.
        complete: each file has its end.
    """

    cell: Cell
    layout: TickLayout
    ticks: Records
    log_times_ns: np.ndarray[Any, np.dtype[np.uint64]]
    duplicates: int
    events: list[JsonMessage]
    requests: list[JsonMessage]
    plans: dict[int, dict[str, Any]]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    complete: bool
    lines: list[JsonMessage] = field(default_factory=list)

    def kinds(self) -> list[str]:
        """Kinds of the events, in order."""
        return [str(event.data["kind"]) for event in self.events]


@dataclass(slots=True)
class _Reading:
    layout: TickLayout | None = None
    cell: Cell | None = None
    records: list[Records] = field(default_factory=list)
    times: list[np.ndarray[Any, np.dtype[np.uint64]]] = field(default_factory=list)
    topics: dict[str, list[JsonMessage]] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = True


def logs_in(directory: Path) -> list[Path]:
    """The log files of a directory, oldest first."""
    return sorted(directory.glob("*.mcap"), key=lambda path: path.stat().st_mtime_ns)


def read_log(*paths: Path) -> Log:
    """All ticks and messages of these files.

    Raises:
        LogError: no cell file inside, a record of another layout, a damaged chunk, or one tick with two contents.
    """
    reading = _Reading()
    for path in paths:
        _read_file(path, reading)
    if reading.layout is None or reading.cell is None:
        raise LogError(f"no cell file in {', '.join(map(str, paths)) or 'no file'}")
    blank = np.empty(0, reading.layout.dtype)
    ticks, times, duplicates = _unique(
        np.concatenate([blank, *reading.records]), np.concatenate([np.empty(0, np.uint64), *reading.times])
    )
    return Log(
        cell=reading.cell,
        layout=reading.layout,
        ticks=ticks,
        log_times_ns=times,
        duplicates=duplicates,
        events=reading.topics.get(LOG_EVENTS, []),
        requests=reading.topics.get(LOG_REQUESTS, []),
        plans={message.data["plan_id"]: message.data for message in reading.topics.get(LOG_PLANS, [])},
        metadata=reading.metadata,
        attachments=reading.attachments,
        complete=reading.complete,
        lines=reading.topics.get(LOG_LINES, []),
    )


def _unique(records: Records, times: Any) -> tuple[Records, Any, int]:
    order = np.argsort(records["tick"], kind="stable")
    records, times = records[order], times[order]
    again = np.flatnonzero(np.diff(records["tick"].astype(np.int64)) == 0) + 1
    for index in again:
        if records[index].tobytes() != records[index - 1].tobytes():
            raise LogError(f"tick {records['tick'][index]} is in the log twice, with different contents")
    keep = np.ones(len(records), dtype=bool)
    keep[again] = False
    return records[keep], times[keep], len(again)


def _read_file(path: Path, reading: _Reading) -> None:
    channels: dict[int, str] = {}
    with path.open("rb") as stream:
        for record in _records(stream, reading):
            if isinstance(record, Attachment):
                _attachment(record, reading)
            elif isinstance(record, Metadata):
                reading.metadata[record.name] = dict(record.metadata)
            elif isinstance(record, Chunk):
                _chunk(record, channels, reading)


def _records(stream: Any, reading: _Reading) -> Iterator[McapRecord]:
    """Until the end, wherever that is."""
    records = StreamReader(stream, emit_chunks=True, record_size_limit=64 * 1024 * 1024).records
    while True:
        try:
            record = next(records)
        except StopIteration:
            return
        except (McapError, struct.error, EOFError):
            reading.complete = False
            return
        yield record


def _attachment(record: Attachment, reading: _Reading) -> None:
    reading.attachments[record.name] = record.data
    if record.name == "cell.toml":
        cell = parse_cell(record.data.decode(), record.name)
        layout = TickLayout(len(cell.axes), len(cell.groups))
        if reading.layout is not None and reading.layout.dtype != layout.dtype:
            raise LogError("files of different cells")
        reading.cell, reading.layout = cell, layout


def _chunk(chunk: Chunk, channels: dict[int, str], reading: _Reading) -> None:
    data = _unpacked(chunk)
    offsets, times = [], []
    at = 0
    while at < len(data):
        opcode, length = data[at], int.from_bytes(data[at + 1 : at + 9], "little")
        if opcode == Opcode.CHANNEL:
            identifier, topic, encoding = _channel(data[at + 9 : at + 9 + length])
            channels[identifier] = topic if encoding == "json" or topic == LOG_SETPOINTS else OTHER
        elif opcode == Opcode.MESSAGE:
            _, _, channel, _, log_time, _ = _MESSAGE.unpack_from(data, at)
            begin, end = at + _MESSAGE.size, at + 9 + length
            if channels[channel] == LOG_SETPOINTS:
                if reading.layout is None or end - begin != reading.layout.size:
                    raise LogError(f"a tick of {end - begin} bytes")
                offsets.append(begin)
                times.append(log_time)
            elif channels[channel] != OTHER:
                message = JsonMessage(log_time, json.loads(data[begin:end]))
                reading.topics.setdefault(channels[channel], []).append(message)
        at += 9 + length
    if offsets and reading.layout is not None:
        reading.records.append(reading.layout.decode_many(data, offsets))
        reading.times.append(np.array(times, np.uint64))


def _channel(body: bytes) -> tuple[int, str, str]:
    identifier, _, size = struct.unpack_from("<HHI", body)
    (more,) = struct.unpack_from("<I", body, 8 + size)
    return identifier, body[8 : 8 + size].decode(), body[12 + size : 12 + size + more].decode()


def _unpacked(chunk: Chunk) -> bytes:
    if chunk.compression not in ("", "zstd"):
        raise LogError(f"compression {chunk.compression!r}")
    data = chunk.data if not chunk.compression else zstandard.decompress(chunk.data, chunk.uncompressed_size)
    if zlib.crc32(data) != chunk.uncompressed_crc:
        raise LogError("a damaged chunk")
    return data
