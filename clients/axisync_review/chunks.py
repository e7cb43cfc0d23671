"""Chunks of a log: unpacked, checked, and taken apart without touching each message.

Messages of `/setpoints` have one size, so that a run of them is found by the heads alone, and read as one array.
"""

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap.opcode import Opcode

from axisync_review.container import HEAD

MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Opcode, length, channel, sequence, log time, publish time."""
MESSAGE_OVERHEAD = MESSAGE_HEAD.size - HEAD.size
_MESSAGE = int(Opcode.MESSAGE)
_CONSTANT = 11
"""Bytes at the beginning of a message that all of one channel and size share: opcode, length, channel."""
_CHUNK = struct.Struct("<QQQI")
CHUNK_MAX = 256 * 1024 * 1024
"""No chunk of ours is larger; a damaged one may say anything."""

_zstd = zstandard.ZstdDecompressor()


class DamagedChunk(ValueError):
    """A chunk that cannot be unpacked, or whose checksum is wrong."""


class Run(NamedTuple):
    """`messages` messages of one channel, all of `length` bytes with their heads, from `begin` on."""

    begin: int
    messages: int
    length: int
    channel: int


class Other(NamedTuple):
    """A record that is no message: schema or channel."""

    opcode: int
    begin: int
    end: int


def unpack(body: bytes) -> bytes:
    """The records of a chunk.

    Raises:
        DamagedChunk: see there.
    """
    try:
        _, _, size, crc = _CHUNK.unpack_from(body)
        (name_length,) = struct.unpack_from("<I", body, _CHUNK.size)
        at = _CHUNK.size + 4 + name_length
        compression = bytes(body[_CHUNK.size + 4 : at])
        (length,) = struct.unpack_from("<Q", body, at)
    except struct.error:
        raise DamagedChunk("a chunk without a whole head") from None
    packed = body[at + 8 : at + 8 + length]
    if size > CHUNK_MAX or len(packed) != length:
        raise DamagedChunk("a chunk whose sizes make no sense")
    data = _decompress(compression, packed, size)
    if len(data) != size or (crc and zlib.crc32(data) != crc):
        raise DamagedChunk("a chunk whose checksum is wrong")
    return data


def _decompress(compression: bytes, packed: bytes, size: int) -> bytes:
    try:
        if compression == b"zstd":
            return _zstd.decompress(packed, max_output_size=size) if size else b""
        if compression == b"lz4":
            return bytes(lz4.frame.decompress(packed))
    except (zstandard.ZstdError, RuntimeError, MemoryError):
        raise DamagedChunk("a chunk that cannot be decompressed") from None
    if compression:
        raise DamagedChunk(f"a chunk in a compression that is not known: {compression[:20]!r}")
    return packed


def walk(data: bytes) -> Iterator[Run | Other]:
    """What a chunk holds, in order; messages of one channel and size that follow each other come as one run.

    Raises:
        DamagedChunk: a record that reaches beyond the chunk.
    """
    at, size = 0, len(data)
    while at < size:
        if at + HEAD.size > size:
            raise DamagedChunk("a chunk that ends within a record")
        opcode, length = HEAD.unpack_from(data, at)
        end = at + HEAD.size + length
        if end > size or (opcode == _MESSAGE and length < MESSAGE_OVERHEAD):
            raise DamagedChunk("a chunk that ends within a record")
        if opcode == _MESSAGE:
            count, stride = _alike(data, at, end - at), end - at
            yield Run(at, count, stride, data[at + HEAD.size] | data[at + HEAD.size + 1] << 8)
            at += count * stride
        else:
            yield Other(opcode, at + HEAD.size, end)
            at = end


def _alike(data: bytes, begin: int, stride: int) -> int:
    """How many messages from `begin` on have the head of the first."""
    head, at, last = data[begin : begin + _CONSTANT], begin + stride, len(data) - stride
    while at <= last and data.startswith(head, at):
        at += stride
    return (at - begin) // stride
