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


@pytest.mark.parametrize(
    ("can_id", "data", "stuffed"),
    [
        # 0 10101010101 000 0000 and CRC: seven zeros in a row take one stuff bit, unless the CRC adds more.
        (0x555, b"", None),
        (0x000, bytes(8), None),
        (0x7FF, b"\xff" * 8, None),
    ],
)
def test_length_stays_between_the_bounds(can_id: int, data: bytes, stuffed: int | None):
    plain = 44 + 8 * len(data)
    worst = plain + (34 + 8 * len(data) - 1) // 4
    assert plain < frame_bits(can_id, data) <= worst


def test_all_zero_frame_by_hand():
    # Identifier 0, no data: 19 zeros, and their CRC is 0, so 34 zeros: a one after the first five (00000 1), then one
    # after each further five zeros, since the stuff bit ends every run: 34 // 5 = 6.
    assert crc15(0, b"") == 0
    assert frame_bits(0, b"") == 34 + 6 + TRAILER


def test_worst_case_pattern_reaches_the_formula():
    # Runs that continue each stuff bit (0000 0111 1000 0111 1...) are the worst: one stuff bit for every four bits.
    best = max(frame_bits(can_id, bytes([a, b] * 4)) for can_id in (0x078, 0x07C, 0x03C) for a, b in
               [(0x3C, 0x3C), (0x78, 0x78), (0x87, 0x87), (0xC3, 0xC3), (0x0F, 0x0F), (0xF0, 0xF0), (0x1E, 0x1E)])  # fmt: skip
    assert 44 + 64 + 15 < best <= 44 + 64 + 24
