"""Bits of a classical CAN frame on the wire: CRC and bit stuffing (ISO 11898-1, 10.4 and 10.5), and what they cost.

The frame from SOF to CRC is walked a byte at a time by two tables: one for the CRC register, one for the stuffing state
(last bit and how often it has just been sent). Only so is the true length affordable for every frame of a busy bus.
"""

from functools import lru_cache

EXTENDED = 0x80000000
REMOTE = 0x40000000
ERROR = 0x20000000
"""Flags above an identifier, as in SocketCAN's can_id."""
STANDARD_MASK = 0x7FF
EXTENDED_MASK = 0x1FFFFFFF

_CRC_POLYNOMIAL = 0x4599
_TRAILER_BITS = 1 + 2 + 7
"""CRC delimiter, ACK slot and delimiter, end of frame: never stuffed."""
INTERFRAME_BITS = 3

_RUN_MAX = 5


def _crc_step(register: int, bits: int, count: int) -> int:
    for i in range(count - 1, -1, -1):
        feedback = ((register >> 14) ^ (bits >> i)) & 1
        register = (register << 1) & 0x7FFF
        if feedback:
            register ^= _CRC_POLYNOMIAL
    return register


def _stuff_step(state: int, bits: int, count: int) -> tuple[int, int]:
    """The state after `count` bits, and the stuff bits among them; state = 8 * last bit + its run (0: none)."""
    last, run, stuffed = state >> 3, state & 7, 0
    for i in range(count - 1, -1, -1):
        bit = (bits >> i) & 1
        run = run + 1 if run and bit == last else 1
        last = bit
        if run == _RUN_MAX:
            stuffed += 1
            last, run = 1 - bit, 1
    return 8 * last + run, stuffed


_STATES = 16
_CRC_TABLE = [_crc_step(byte << 7, 0, 8) for byte in range(256)]
# Entry: 4096 * stuff bits + 256 * next state, so that the state is ready to be or-ed with the next byte.
_STUFF_TABLE = [
    (stuffed << 12) | (state << 8)
    for start in range(_STATES)
    for byte in range(256)
    for state, stuffed in (_stuff_step(start, byte, 8),)
]
_STATE_MASK = 0xF00
_STUFF_TABLE_7 = [_stuff_step(start, bits, 7)[1] for start in range(_STATES) for bits in range(128)]
"""Stuff bits in the last seven bits of the CRC."""


@lru_cache(maxsize=4096)
def _header(can_id: int, length: int) -> tuple[int, int, int, int]:
    """CRC register, stuffing state << 8 and stuff bits after the header, and the header's length in bits."""
    remote = 1 if can_id & REMOTE else 0
    if can_id & EXTENDED:
        identifier = can_id & EXTENDED_MASK
        # SOF, 11 bits, SRR and IDE recessive, 18 bits, RTR, r1, r0, DLC.
        bits = ((identifier >> 18) << 2 | 3) << 18 | (identifier & 0x3FFFF)
        bits, count = (bits << 3 | remote << 2) << 4 | length, 39
    else:
        # SOF, 11 bits, RTR, IDE and r0 dominant, DLC.
        bits, count = ((can_id & STANDARD_MASK) << 3 | remote << 2) << 4 | length, 19
    state, stuffed = _stuff_step(0, bits, count)
    return _crc_step(0, bits, count), state << 8, stuffed, count


@lru_cache(maxsize=8192)
def frame_bits(can_id: int, data: bytes) -> int:
    """Bits that the frame occupies from SOF to the end of EOF, stuff bits included, interframe space not.

    `can_id` carries the flags EXTENDED and REMOTE; a remote frame's `data` only gives its length code.
    """
    crc, state, stuffed, count = _header(can_id, len(data))
    if not can_id & REMOTE:
        for byte in data:
            crc = ((crc << 8) & 0x7FFF) ^ _CRC_TABLE[(crc >> 7) ^ byte]
            entry = _STUFF_TABLE[state | byte]
            state = entry & _STATE_MASK
            stuffed += entry >> 12
        count += 8 * len(data)
    entry = _STUFF_TABLE[state | (crc >> 7)]
    last = _STUFF_TABLE_7[(entry & _STATE_MASK) >> 1 | crc & 0x7F]
    return count + 15 + stuffed + (entry >> 12) + last + _TRAILER_BITS


def crc15(can_id: int, data: bytes) -> int:
    """The frame's CRC sequence (ISO 11898-1, 10.4.2.6)."""
    crc = _header(can_id, len(data))[0]
    for byte in b"" if can_id & REMOTE else data:
        crc = ((crc << 8) & 0x7FFF) ^ _CRC_TABLE[(crc >> 7) ^ byte]
    return crc
