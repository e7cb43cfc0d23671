"""EMCY producer: error register 0x1001, history 0x1003, emergency frames (CiA 301, 7.2.7)."""

import struct
from collections.abc import Callable
from enum import IntEnum, IntFlag

FRAME = struct.Struct("<HB5s")
HISTORY_MAX = 8


class ErrorCode(IntEnum):
    """Codes that this drive knows (CiA 301, table 26; CiA 402-2, error codes)."""

    NONE = 0x0000
    OVER_VOLTAGE = 0x3210
    """Of the DC link."""
    UNDER_VOLTAGE = 0x3220
    OVER_TEMPERATURE = 0x4310
    SAFE_TORQUE_OFF = 0x5441
    HEARTBEAT = 0x8130
    """The consumed heartbeat is missing."""
    BUS_OFF_RECOVERED = 0x8140
    PDO_LENGTH = 0x8210
    """An RPDO shorter than its mapping."""
    SYNC_LENGTH = 0x8240
    """A SYNC without the counter that 0x1019 asks for."""
    RPDO_TIMEOUT = 0x8250
    FOLLOWING_ERROR = 0x8611
    SYNC_LOST = 0x8700
    IMPLAUSIBLE_TARGET = 0xFF01
    """A target further away than the axis can go in one cycle."""


SELF_HEALING = frozenset({
    ErrorCode.OVER_VOLTAGE, ErrorCode.UNDER_VOLTAGE, ErrorCode.OVER_TEMPERATURE, ErrorCode.SAFE_TORQUE_OFF,
    ErrorCode.HEARTBEAT, ErrorCode.PDO_LENGTH, ErrorCode.SYNC_LENGTH, ErrorCode.RPDO_TIMEOUT, ErrorCode.SYNC_LOST,
})  # fmt: skip
"""They go with their cause; a fault reset cannot clear them. All others stay until one."""
DISABLING = frozenset({
    ErrorCode.OVER_VOLTAGE, ErrorCode.UNDER_VOLTAGE, ErrorCode.OVER_TEMPERATURE, ErrorCode.SAFE_TORQUE_OFF,
    ErrorCode.HEARTBEAT,
})  # fmt: skip
"""They keep the drive from being enabled, and a fault from being reset, while they last."""


class Register(IntFlag):
    """Bits of 0x1001."""

    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


_BY_CLASS = {
    0x2: Register.CURRENT, 0x3: Register.VOLTAGE, 0x4: Register.TEMPERATURE, 0x8: Register.COMMUNICATION,
    0xF: Register.MANUFACTURER,
}  # fmt: skip
_POSITION_CONTROL = 0x86


def register_of(code: int) -> Register:
    """The bits of the error register that an error sets, by its class (CiA 301, table 26)."""
    if code >> 8 == _POSITION_CONTROL:
        return Register.GENERIC | Register.PROFILE
    return Register.GENERIC | _BY_CLASS.get(code >> 12, Register.GENERIC)


COB_ID = 0x80
INVALID = 1 << 31


class Emergencies:
    """Errors that are present, and those that were; each change is one emergency frame.

    Attributes:
        active: codes of the errors that are present.
        history: of 0x1003, newest first.
        code: 0x603F: the newest error, 0 after a fault reset or when enabled again.
        cob_id: 0x1014; bit 31 set: no frames.
        inhibit_ns: 0x1015: at least so long between two frames.
    """

    def __init__(self, node_id: int, send: Callable[[int, bytes, int], None]) -> None:
        self.cob_id = COB_ID + node_id
        self.inhibit_ns = 0
        self._send_frame = send
        self._next = 0
        self.active: set[int] = set()
        self.history: list[int] = []
        self.code = 0

    @property
    def register(self) -> int:
        """0x1001."""
        bits = Register(0)
        for code in self.active:
            bits |= register_of(code)
        return int(bits)

    def occur(self, code: int, now: int, info: bytes = b"") -> bool:
        """An error has appeared; False where it was there already."""
        if code in self.active:
            return False
        self.active.add(code)
        self.note(code, now, info)
        return True

    def note(self, code: int, now: int, info: bytes = b"") -> None:
        """An error that is over already: told and remembered, but not present."""
        self.code = code
        self.history = [code, *self.history][:HISTORY_MAX]
        self._send(FRAME.pack(code, self.register, info), now)

    def heal(self, now: int, *codes: int) -> None:
        """Errors have gone: "error reset", with what remains in the register."""
        if not self.active.isdisjoint(codes):
            self.active.difference_update(codes)
            self._send(FRAME.pack(ErrorCode.NONE, self.register, b""), now)

    def reset(self, now: int) -> None:
        """A fault reset: only what has a cause that lasts remains."""
        self.code = 0
        self.heal(now, *(self.active - SELF_HEALING))

    def forget(self) -> None:
        """As after power-on."""
        self.active.clear()
        self.history.clear()
        self.code = 0

    def _send(self, data: bytes, now: int) -> None:
        if self.cob_id & INVALID:
            return
        at = max(now, self._next)
        self._next = at + self.inhibit_ns
        self._send_frame(self.cob_id & 0x7FF, data, at)
