"""The records of an MCAP file (https://mcap.dev/spec), one after the other, whole or cut anywhere."""

import io
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from axisync_review.errors import GIVE_A_LOG, LogUnreadable

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
"""Opcode and length of every record."""
BUFFER_BYTES = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Frame:
    """One record: where it begins in the file, its opcode, and its body."""

    offset: int
    opcode: int
    body: bytes

    @property
    def end(self) -> int:
        """First byte after it."""
        return self.offset + HEAD.size + len(self.body)


@dataclass(frozen=True, slots=True)
class Damage:
    """Where a file stops to make sense, and why."""

    offset: int
    text: str


class Container:
    """An open file. Iterate once; `damage` then says whether, where and why the file ends before its end.

    Attributes:
        size: bytes of the file.
        position: bytes read so far.
    """

    def __init__(self, path: Path) -> None:
        """
        Raises:
            LogUnreadable: no such file, not readable, empty, or not an MCAP file.
        """
        self.path = path
        self.damage: Damage | None = None
        self.position = 0
        try:
            self._stream: BinaryIO = path.open("rb", buffering=BUFFER_BYTES)
            self.size = os.fstat(self._stream.fileno()).st_size
            magic = self._stream.read(len(MAGIC))
        except OSError as error:
            raise LogUnreadable(f"{path} cannot be read: {error.strerror or error}") from None
        if magic != MAGIC:
            self._stream.close()
            raise LogUnreadable(f"{path} is empty" if not magic else f"{path} is not an MCAP file", GIVE_A_LOG)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()

    def __iter__(self) -> Iterator[Frame]:
        """Records up to the footer, or as far as they are whole."""
        self.position = len(MAGIC)
        while True:
            frame = self._next()
            if frame is None:
                return
            self.position = frame.end
            yield frame
            if frame.opcode == Opcode.FOOTER:
                self._check_end(frame)
                return

    def _next(self) -> Frame | None:
        try:
            head = self._stream.read(HEAD.size)
            if len(head) < HEAD.size:
                self._broken("the file ends without its end record")
                return None
            opcode, length = HEAD.unpack(head)
            left = self.size - self.position - HEAD.size
            if not opcode or length > left:
                self._broken(f"a record of {length:,} bytes where the file has {left:,} more")
                return None
            return Frame(self.position, opcode, self._stream.read(length))
        except OSError as error:
            self._broken(f"the file cannot be read further: {error.strerror or error}")
            return None

    def _broken(self, text: str) -> None:
        self.damage = Damage(self.position, text)

    def _check_end(self, footer: Frame) -> None:
        if self._stream.read(len(MAGIC)) != MAGIC:
            self.damage = Damage(footer.end, "the file ends without its end mark")


def body_stream(body: bytes) -> ReadDataStream:
    """A record's body for the `read` methods of `mcap.records`."""
    return ReadDataStream(io.BytesIO(body))
