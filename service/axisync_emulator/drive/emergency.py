"""EMCY producer: error register 0x1001, history 0x1003, emergency frames (CiA 301, 7.2.7)."""

import struct
from collections.abc import Callable
from enum import IntEnum

FRAME = struct.Struct("<HB5s")
HISTORY_MAX = 8


class ErrorCode(IntEnum):
    """Codes that this drive knows (CiA 301, table 26; CiA 402-2, error codes)."""

    NONE = 0x0000
    HEARTBEAT = 0x8130
    """The consumed heartbeat is missing."""
    PDO_LENGTH = 0x8210
    """An RPDO shorter than its mapping."""
    SYNC_LENGTH = 0x8240
    """A SYNC without the counter that 0x1019 asks for."""
    RPDO_TIMEOUT = 0x8250
    FOLLOWING_ERROR = 0x8611
    SYNC_LOST = 0x8700
    IMPLAUSIBLE_TARGET = 0xFF01
    """A target further away than the axis can go in one cycle."""


class Register(IntEnum):
    """Bits of 0x1001."""

    GENERIC = 0x01
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


_REGISTER = {
    ErrorCode.HEARTBEAT: Register.COMMUNICATION,
    ErrorCode.PDO_LENGTH: Register.COMMUNICATION,
    ErrorCode.SYNC_LENGTH: Register.COMMUNICATION,
    ErrorCode.RPDO_TIMEOUT: Register.COMMUNICATION,
    ErrorCode.SYNC_LOST: Register.COMMUNICATION,
    ErrorCode.FOLLOWING_ERROR: Register.PROFILE,
    ErrorCode.IMPLAUSIBLE_TARGET: Register.MANUFACTURER,
}


COB_ID = 0x80


class Emergencies:
    """Errors that are present, and those that were; each change is one emergency frame."""

    def __init__(self, node_id: int, send: Callable[[int, bytes, int], None]) -> None:
        self._can_id = COB_ID + node_id
        self._send = send
        self.active: set[ErrorCode] = set()
        self.history: list[int] = []
        self.code = 0
        """0x603F: the newest error, 0 after a fault reset or when enabled again."""

    @property
    def register(self) -> int:
        """0x1001."""
        bits = 0
        for code in self.active:
            bits |= Register.GENERIC | _REGISTER[code]
        return bits

    def occur(self, code: ErrorCode, now: int, info: bytes = b"") -> bool:
        """An error has appeared; False where it was there already."""
        if code in self.active:
            return False
        self.active.add(code)
        self.code = code
        self.history = [code, *self.history][:HISTORY_MAX]
        self._send(self._can_id, FRAME.pack(code, self.register, info), now)
        return True

    def heal(self, now: int, *codes: ErrorCode) -> None:
        """Errors have gone: "error reset", with what remains in the register."""
        if not self.active.isdisjoint(codes):
            self.active.difference_update(codes)
            self._send(self._can_id, FRAME.pack(ErrorCode.NONE, self.register, b""), now)
