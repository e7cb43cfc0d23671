"""The ring of ticks: what is read is whole and is what was asked for, or is said not to be there."""

import mmap
import threading

import pytest

from axisync_schemas.memory import RING_SECONDS
from axisync_schemas.tick_ring import HEADER_BYTES, Missing, TickRing, slots_for
from axisync_schemas.ticks import TickLayout

LAYOUT = TickLayout(12, 2)


def ring(slots: int = 8) -> tuple[TickRing, bytearray]:
    buffer = bytearray(TickRing.size(LAYOUT, slots))
    return TickRing(buffer, LAYOUT, slots), buffer


def put(one: TickRing, tick: int) -> bytes:
    """A record whose values all tell its tick."""
    record = LAYOUT.new()
    record["tick"] = tick
    record["position"] = float(tick)
    record["jerk"] = -float(tick)
    one.write(tick, record)
    return record.tobytes()


def test_what_was_written_is_read() -> None:
    one, _ = ring()
    written = [put(one, tick) for tick in range(1, 9)]
    assert [one.read(tick) for tick in range(1, 9)] == written


def test_an_empty_ring_has_nothing_not_even_tick_0() -> None:
    one, _ = ring()
    assert [one.read(tick) for tick in (0, 1, 7, 8, 2**40)] == [None] * 5
    assert one.missing(1) is Missing.NOT_WRITTEN


def test_newer_ticks_take_the_place_of_older_ones() -> None:
    one, _ = ring()
    for tick in range(1, 12):
        put(one, tick)
    assert one.read(3) is None
    assert one.missing(3) is Missing.OVERWRITTEN
    assert one.read(11) is not None
    assert one.read(12) is None
    assert one.missing(12) is Missing.NOT_WRITTEN


def test_ticks_beyond_32_bits() -> None:
    one, _ = ring()
    tick = 2**40 + 3
    assert one.read(tick) is None
    assert put(one, tick) == one.read(tick)
    assert one.read(3) is None


@pytest.mark.parametrize("position", [8, 12, HEADER_BYTES, HEADER_BYTES + 300, HEADER_BYTES + LAYOUT.size - 1])
def test_a_damaged_slot_is_not_read(position: int) -> None:
    """Checksum, length, and the record's first, middle and last byte."""
    one, buffer = ring()
    put(one, 8)
    buffer[position] ^= 1
    assert one.read(8) is None


def test_a_slot_in_the_middle_of_a_write_is_neither_tick() -> None:
    one, buffer = ring()
    put(one, 8)
    buffer[0:8] = bytes(8)
    assert one.read(8) is None
    assert one.read(16) is None
    assert one.missing(8) is Missing.OVERWRITTEN


def test_the_record_of_one_tick_under_the_number_of_another_is_not_read() -> None:
    one, buffer = ring()
    put(one, 8)
    buffer[0:8] = (17).to_bytes(8, "little")
    assert one.read(16) is None


def test_a_reader_beside_a_writer_never_sees_a_mixture() -> None:
    slots = 2
    shared = mmap.mmap(-1, TickRing.size(LAYOUT, slots))
    writer, reader = TickRing(shared, LAYOUT, slots), TickRing(shared, LAYOUT, slots)
    newest = [0]

    def write() -> None:
        for tick in range(1, 30001):
            put(writer, tick)
            newest[0] = tick

    thread = threading.Thread(target=write)
    thread.start()
    found = 0
    while thread.is_alive():
        tick = newest[0]
        data = reader.read(tick)
        if data is None:
            continue
        record = LAYOUT.decode(data)[0]
        assert record["tick"] == tick
        assert (record["position"] == tick).all()
        assert (record["jerk"] == -tick).all()
        found += 1
    thread.join()
    assert found > 10
    for one in (writer, reader):
        one.close()
    shared.close()


@pytest.mark.parametrize("period", [0.0005, 0.001, 0.002, 0.004, 0.02])
def test_the_ring_holds_ten_seconds(period: float) -> None:
    slots = slots_for(period)
    assert slots & (slots - 1) == 0
    assert RING_SECONDS <= slots * period < 2 * RING_SECONDS + 2 * period


def test_sizes_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="power of two"):
        TickRing(bytearray(100000), LAYOUT, 6)
    with pytest.raises(ValueError, match="hold no 8 slots"):
        TickRing(bytearray(TickRing.size(LAYOUT, 8) - 1), LAYOUT, 8)


def test_records_lie_aligned_so_that_sequence_words_are_stored_whole() -> None:
    for axes in range(1, 20):
        layout = TickLayout(axes, 1)
        assert TickRing.size(layout, 2) // 2 % 8 == 0


def test_closing_lets_the_mapping_be_closed() -> None:
    shared = mmap.mmap(-1, TickRing.size(LAYOUT, 2))
    one = TickRing(shared, LAYOUT, 2)
    with pytest.raises(BufferError):
        shared.close()
    one.close()
    shared.close()
