"""EMCY (CiA 301, 7.2.7): error codes in words."""

import struct
from dataclasses import dataclass

EMCY_BASE = 0x080
_EMCY = struct.Struct("<HB5s")

_WORDS = {
    0x0000: "no error",
    0x1000: "generic error",
    0x2310: "continuous over-current",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "device over-temperature",
    0x4310: "drive over-temperature",
    0x5441: "safe torque off",
    0x7121: "motor blocked",
    0x7300: "sensor error",
    0x7305: "incremental sensor error",
    0x8110: "CAN overrun: objects lost",
    0x8120: "CAN in error passive mode",
    0x8130: "heartbeat of the controller lost",
    0x8140: "recovered from bus-off",
    0x8150: "two nodes send one identifier",
    0x8210: "PDO not processed: length",
    0x8250: "RPDO time-out",
    0x8611: "following error",
    0x8700: "SYNC lost",
    0xFF01: "target position implausible",
}
_CLASSES = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current, device input side",
    0x22: "current inside the device",
    0x23: "current, device output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x61: "internal software",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x86: "position control",
    0x90: "external error",
    0xF0: "additional functions",
    0xFF: "manufacturer specific",
}


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
    """An error code in words: the code itself, its class, or at least its number."""
    return _WORDS.get(code) or _CLASSES.get(code >> 8) or _CLASSES.get(code >> 8 & 0xF0) or "unknown error"


def parse_emergency(data: bytes) -> Emergency | None:
    """The emergency in a frame, or None where its length is wrong."""
    return Emergency(*_EMCY.unpack(data)) if len(data) == _EMCY.size else None
