"""The process data of the cycle, packed by hand (a general mapper costs more than the cycle has)."""

import struct

RPDO1_BASE = 0x200
TPDO1_BASE = 0x180
TPDO2_BASE = 0x280

_RPDO1 = struct.Struct("<Hi")
_TPDO1 = struct.Struct("<Hi")
_TPDO2 = struct.Struct("<ih")

make_rpdo1 = _RPDO1.pack
"""RPDO1: controlword (0x6040), target position in counts (0x607A)."""

TPDO1_SIZE = _TPDO1.size
parse_tpdo1 = _TPDO1.unpack
"""TPDO1: statusword (0x6041), position actual value in counts (0x6064)."""

TPDO2_SIZE = _TPDO2.size
parse_tpdo2 = _TPDO2.unpack
"""TPDO2: velocity actual value (0x606C) in the drive's units, torque actual value (0x6077) in 1/1000 of the rated."""

RPDO1_MAPPING = (0x60400010, 0x607A0020)
TPDO1_MAPPING = (0x60410010, 0x60640020)
TPDO2_MAPPING = (0x606C0020, 0x60770010)
"""Mapping entries as objects 0x1600, 0x1A00 and 0x1A01 hold them: index, sub-index, bits."""
