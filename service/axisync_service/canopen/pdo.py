"""The process data of the cycle, packed by hand (a general mapper costs more than the cycle has)."""

import struct

RPDO1_BASE = 0x200
TPDO1_BASE = 0x180

_RPDO1 = struct.Struct("<Hi")
_TPDO1 = struct.Struct("<Hi")

make_rpdo1 = _RPDO1.pack
"""RPDO1: controlword (0x6040), target position in counts (0x607A)."""

TPDO1_SIZE = _TPDO1.size
parse_tpdo1 = _TPDO1.unpack
"""TPDO1: statusword (0x6041), position actual value in counts (0x6064)."""

RPDO1_MAPPING = (0x60400010, 0x607A0020)
TPDO1_MAPPING = (0x60410010, 0x60640020)
"""Mapping entries as objects 0x1600 and 0x1A00 hold them: index, sub-index, bits."""
