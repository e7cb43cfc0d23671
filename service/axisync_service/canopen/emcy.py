"""EMCY (CiA 301, 7.2.7): emergency frames, with error code and error register in words."""

import struct
from dataclasses import dataclass

from axisync_service.canopen.emcy_words import CLASSES, CODES, REGISTER_BITS

EMCY_BASE = 0x080
_EMCY = struct.Struct("<HB5s")


@dataclass(frozen=True, slots=True)
class Emergency:
    """An EMCY frame: error code, error register (0x1001), five bytes of the manufacturer's."""

    code: int
    register: int
    manufacturer: bytes

    @property
    def words(self) -> str:
        """The code in words."""
        return describe(self.code)


def describe(code: int) -> str:
    """An error code in words: the code itself, else the narrowest class that contains it."""
    for known, words in ((code, CODES), (code & 0xFFF0, CLASSES), (code & 0xFF00, CLASSES), (code & 0xF000, CLASSES)):
        if known in words:
            return words[known]
    return "unknown error"


def describe_register(register: int) -> str:
    """The error register 0x1001 in words (CiA 301, 7.5.2.2)."""
    return ", ".join(words for bit, words in enumerate(REGISTER_BITS) if register >> bit & 1) or "no error"


def parse_emergency(data: bytes) -> Emergency | None:
    """The emergency in a frame, or None where its length is wrong."""
    return Emergency(*_EMCY.unpack(data)) if len(data) == _EMCY.size else None
