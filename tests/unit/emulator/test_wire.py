"""Stuffed lengths and CRCs, against a bit-by-bit reference and frames worked out by hand."""

import random

import pytest

from axisync_emulator.simcan.wire import EXTENDED, REMOTE, crc15, frame_bits

TRAILER = 10


def sent(can_id: int, data: bytes) -> list[int]:
    """SOF to the end of the data field, as bits."""
    remote = int(bool(can_id & REMOTE))
    if can_id & EXTENDED:
        identifier = can_id & 0x1FFFFFFF
        head = "0" + f"{identifier >> 18:011b}" + "11" + f"{identifier & 0x3FFFF:018b}" + f"{remote}00"
    else:
        head = "0" + f"{can_id & 0x7FF:011b}" + f"{remote}00"
    body = "" if remote else "".join(f"{byte:08b}" for byte in data)
    return [int(bit) for bit in head + f"{len(data):04b}" + body]


def reference_crc(bits: list[int]) -> int:
    """ISO 11898-1: polynomial 0xC599, register 0."""
    value = 0
    for bit in [*bits, *[0] * 15]:
        value = value << 1 | bit
        if value >> 15:
            value ^= 0xC599
    return value


def reference_length(can_id: int, data: bytes) -> int:
    bits = sent(can_id, data)
    bits += [int(bit) for bit in f"{reference_crc(bits):015b}"]
    out: list[int] = []
    run = 0
    for bit in bits:
        run = run + 1 if out and bit == out[-1] else 1
        out.append(bit)
        if run == 5:
            out.append(1 - bit)
            run = 1
    return len(out) + TRAILER


def frames(count: int) -> list[tuple[int, bytes]]:
    source = random.Random(4)
    alphabet = (0x00, 0xFF, 0x0F, 0xF8, 0x55)
    result = []
    for _ in range(count):
        can_id = source.choice((source.randrange(2048), source.randrange(1 << 29) | EXTENDED, 0, 0x7FF))
        can_id |= REMOTE if source.random() < 0.1 else 0
        data = bytes(source.choice((*alphabet, source.randrange(256))) for _ in range(source.randrange(9)))
        result.append((can_id, data))
    return result


def test_every_kind_of_frame_is_as_long_as_bit_by_bit():
    for can_id, data in frames(3000):
        assert frame_bits(can_id, data) == reference_length(can_id, data), (hex(can_id), data.hex())


def test_crc_is_that_of_the_standard():
    for can_id, data in frames(300):
        assert crc15(can_id, data) == reference_crc(sent(can_id, data))


@pytest.mark.parametrize("length", range(9))
def test_length_stays_between_the_bounds(length: int):
    plain = 44 + 8 * length
    worst = plain + (34 + 8 * length - 1) // 4
    lengths = {frame_bits(can_id, data) for can_id, data in frames(2000) if len(data) == length and can_id < 0x800}
    assert plain <= min(lengths) < max(lengths) <= worst


def test_all_zero_frame_by_hand():
    # Identifier 0, no data: 19 zeros, and their CRC is 0, so 34 zeros: a one after the first five (00000 1), then one
    # after each further five zeros, since the stuff bit ends every run: 34 // 5 = 6.
    assert crc15(0, b"") == 0
    assert frame_bits(0, b"") == 34 + 6 + TRAILER
