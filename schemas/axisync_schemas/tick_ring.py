"""The ring of tick records in shared memory: one writer, the controller; readers are recorder and front.

A slot holds sequence (tick + 1; 0 while it is rewritten), crc32 and length, and the record. Readers copy, then verify
the sequence before and after and the crc32, since Python has no memory barriers. The newest tick is
`Control[Word.CONTROLLER_TICK]`; ticks count from 1.
"""

import mmap
import zlib
from enum import Enum

from axisync_schemas.memory import slots_for as slots_for
from axisync_schemas.ticks import Records, TickLayout

HEADER_BYTES = 16
_LENGTH_SHIFT = 32
_CRC_MASK = 0xFFFFFFFF


def _stride(layout: TickLayout) -> int:
    """Bytes of a slot: a multiple of 8, so that sequence words are aligned and stored whole."""
    return HEADER_BYTES + (layout.size + 7) // 8 * 8


class Missing(Enum):
    """Why a tick cannot be read."""

    NOT_WRITTEN = "not written"
    """Its slot holds an older tick, or none: it is still to come, or never came."""
    OVERWRITTEN = "overwritten"
    """Its slot holds, or is about to hold, a newer tick."""


class TickRing:
    """`slots` records of `layout` in a buffer of `size(layout, slots)` bytes, all zero at first."""

    def __init__(self, buffer: mmap.mmap | bytearray | memoryview, layout: TickLayout, slots: int) -> None:
        """
        Raises:
            ValueError: `slots` is no power of two, or the buffer is too small.
        """
        if slots < 2 or slots & (slots - 1):
            raise ValueError(f"{slots} slots: not a power of two")
        if len(buffer) < self.size(layout, slots):
            raise ValueError(f"{len(buffer)} bytes hold no {slots} slots of {_stride(layout)}")
        self.layout, self.slots = layout, slots
        self._mask = slots - 1
        self._stride = _stride(layout)
        self._length = layout.size
        self._octets = memoryview(buffer)[: self.size(layout, slots)]
        self._words = self._octets.cast("Q")

    @staticmethod
    def size(layout: TickLayout, slots: int) -> int:
        """Bytes needed."""
        return slots * _stride(layout)

    def write(self, tick: int, record: Records) -> None:
        """Stores the record of `tick`; the caller then moves `Word.CONTROLLER_TICK`."""
        payload = record.tobytes()
        at = (tick & self._mask) * self._stride
        word = at >> 3
        words = self._words
        words[word] = 0
        self._octets[at + HEADER_BYTES : at + HEADER_BYTES + self._length] = payload
        words[word + 1] = _checksum(tick, payload) | self._length << _LENGTH_SHIFT
        words[word] = tick + 1

    def read(self, tick: int) -> bytes | None:
        """The record of `tick`, or None: not there, or just now being rewritten."""
        at = (tick & self._mask) * self._stride
        word = at >> 3
        words = self._words
        if words[word] != tick + 1:
            return None
        header = words[word + 1]
        payload = bytes(self._octets[at + HEADER_BYTES : at + HEADER_BYTES + self._length])
        whole = header == _checksum(tick, payload) | self._length << _LENGTH_SHIFT
        return payload if whole and words[word] == tick + 1 else None

    def missing(self, tick: int) -> Missing:
        """Why `read(tick)` gave None; a slot being rewritten counts as overwritten."""
        word = ((tick & self._mask) * self._stride) >> 3
        sequence, header = self._words[word], self._words[word + 1]
        newer = sequence > tick if sequence else header != 0
        return Missing.OVERWRITTEN if newer else Missing.NOT_WRITTEN

    def close(self) -> None:
        """Lets the mapping be closed."""
        self._words.release()
        self._octets.release()


def _checksum(tick: int, payload: bytes) -> int:
    return zlib.crc32(payload, tick & _CRC_MASK)
