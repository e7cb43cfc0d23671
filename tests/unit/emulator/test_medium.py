"""Who sends when: arbitration, queues, wire time."""

import random

from axisync_emulator.simcan.medium import ERROR_FRAME_BITS, Medium, arbitration_key
from axisync_emulator.simcan.wire import EXTENDED, REMOTE, frame_bits
from axisync_emulator.timers import NEVER

MEGABIT = 1e6


def play(medium: Medium) -> list[tuple[int, int, int]]:
    """(start, completion, can_id) of everything queued."""
    out = []
    while (start := medium.next_start) < NEVER:
        medium.start(start)
        completion = medium.completion
        medium.finish()
        out.append((start, completion, medium.frame[1]))
    return out


def sources(medium: Medium, count: int) -> list[int]:
    return [medium.attach() for _ in range(count)]


def test_a_frame_takes_its_bits():
    medium = Medium(MEGABIT)
    (node,) = sources(medium, 1)
    medium.queue(node, 0x181, bytes(6), 5000)
    assert play(medium) == [(5000, 5000 + 1000 * frame_bits(0x181, bytes(6)), 0x181)]


def test_half_the_bitrate_takes_twice_as_long():
    medium = Medium(MEGABIT / 2)
    (node,) = sources(medium, 1)
    medium.queue(node, 0x181, bytes(6), 0)
    assert play(medium)[0][1] == 2000 * frame_bits(0x181, bytes(6))


def test_lowest_identifier_wins_once_the_bus_is_free():
    medium = Medium(MEGABIT)
    a, b, c = sources(medium, 3)
    medium.queue(a, 0x300, b"", 0)
    medium.queue(b, 0x201, b"", 1000)
    medium.queue(c, 0x080, b"", 2000)
    assert [can_id for *_, can_id in play(medium)] == [0x300, 0x080, 0x201]


def test_three_bits_between_frames():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(a, 0x080, b"", 0)
    medium.queue(b, 0x201, b"", 0)
    first, second = play(medium)
    assert second[0] - first[1] == 3000


def test_one_node_sends_in_the_order_in_which_it_queued():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    for can_id in (0x206, 0x080, 0x201):
        medium.queue(a, can_id, b"", 0)
    medium.queue(b, 0x181, b"", 0)
    assert [can_id for *_, can_id in play(medium)] == [0x181, 0x206, 0x080, 0x201]


def test_a_frame_of_the_past_begins_when_it_can():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(a, 0x100, b"", 1_000_000)
    medium.start(medium.next_start)
    medium.finish()
    medium.queue(b, 0x200, b"", 17)
    assert medium.next_start == medium.now + 3000


def test_equal_identifiers_in_the_order_of_the_nodes():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(b, 0x100, b"b", 0)
    medium.queue(a, 0x100, b"a", 0)
    medium.start(medium.next_start)
    assert medium.frame[2] == b"a"


def test_arbitration_field_order():
    # A data frame beats a remote frame, a standard frame an extended one with the same first eleven bits.
    base = 0x123
    order = [base, base | REMOTE, base << 18 | EXTENDED, base << 18 | EXTENDED | REMOTE, base << 18 | 1 | EXTENDED,
             base + 1]  # fmt: skip
    assert sorted(order, key=arbitration_key) == order


def test_leaving_the_bus_forgets_what_was_queued():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(a, 0x100, b"", 0)
    medium.queue(b, 0x200, b"", 0)
    medium.flush(a)
    assert [can_id for *_, can_id in play(medium)] == [0x200]


def test_a_frame_abandoned_was_never_there():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(a, 0x100, bytes(8), 0)
    medium.queue(b, 0x200, b"", 500)
    medium.start(medium.next_start)
    medium.abandon()
    assert (medium.bits, medium.frames, medium.completion) == (0, 0, NEVER)
    assert [(start, can_id) for start, _, can_id in play(medium)] == [(500, 0x200)]


def test_a_frame_with_other_data_takes_its_own_time():
    medium = Medium(MEGABIT)
    (node,) = sources(medium, 1)
    medium.queue(node, 0x100, bytes(8), 0)
    medium.start(medium.next_start)
    medium.replace(b"\x55" * 8)
    assert medium.completion == 1000 * frame_bits(0x100, b"\x55" * 8)
    assert medium.bits == frame_bits(0x100, b"\x55" * 8) + 3


def test_a_corrupted_frame_is_tried_again_before_all_others_of_its_source():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    for can_id in (0x300, 0x080):
        medium.queue(a, can_id, b"", 0)
    medium.queue(b, 0x200, b"", 1)
    medium.start(medium.next_start)
    medium.corrupt(25)
    assert medium.completion == 1000 * (25 + ERROR_FRAME_BITS)
    assert medium.failed
    medium.finish()
    medium.retry()
    assert [can_id for *_, can_id in play(medium)] == [0x200, 0x300, 0x080]
    assert not medium.failed


def test_a_source_off_the_bus_sends_nothing():
    medium = Medium(MEGABIT)
    a, b = sources(medium, 2)
    medium.queue(a, 0x100, b"", 0)
    medium.disconnect(a)
    medium.queue(a, 0x101, b"", 0)
    medium.queue(b, 0x200, b"", 0)
    assert [can_id for *_, can_id in play(medium)] == [0x200]
    medium.connect(a)
    medium.queue(a, 0x102, b"", 0)
    assert [can_id for *_, can_id in play(medium)] == [0x102]


def test_load_is_the_share_of_bits():
    medium = Medium(MEGABIT)
    (node,) = sources(medium, 1)
    source = random.Random(1)
    for i in range(100):
        medium.queue(node, 0x181, source.randbytes(6), i * 1_000_000)
    bits = sum(frame_bits(*frame) + 3 for frame in [(0x181, d) for d in _payloads()])
    play(medium)
    assert medium.bits == bits
    assert abs(medium.load - bits / (99_000 + bits / 100)) < 1e-3 * medium.load


def _payloads() -> list[bytes]:
    source = random.Random(1)
    return [source.randbytes(6) for _ in range(100)]
