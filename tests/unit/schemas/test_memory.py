"""Shared memory: words, mailbox and plan slots; damage is seen."""

import numpy as np
import pytest

from axisync_schemas.memory import Control, GroupWord, Mailbox, TimingRing, Word
from axisync_schemas.plan_slots import PLAN_SLOT_BYTES, Plan, PlanError, PlanReader, offset, read_plan, write_plan


def test_words_are_separate() -> None:
    control = Control(bytearray(Control.size(3)), 3)
    for value, word in enumerate(Word, start=1):
        control[word] = value
    for group in range(3):
        for word in GroupWord:
            control.set_group(group, word, 100 + 10 * group + word)
    assert [control[word] for word in Word] == list(range(1, len(Word) + 1))
    assert [control.group(g, w) for g in range(3) for w in GroupWord] == [
        100 + 10 * g + w for g in range(3) for w in GroupWord
    ]
    for word in GroupWord:
        assert control.of_groups(word) == [control.group(g, word) for g in range(3)]


def test_mailbox_gives_the_newest_record() -> None:
    box = Mailbox(bytearray(256))
    assert box.read() is None
    box.write(b"one")
    box.write(b"second")
    assert box.read() == b"second"


def test_mailbox_refuses_what_does_not_fit() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        Mailbox(bytearray(32)).write(bytes(32))


@pytest.mark.parametrize("byte", [0, 8, 12, 16, 20])
def test_mailbox_shows_no_torn_record(byte: int) -> None:
    buffer = bytearray(64)
    box = Mailbox(buffer)
    box.write(b"whole")
    buffer[byte] ^= 0x01
    assert box.read() is None


def test_timings_are_read_by_tick() -> None:
    ring = TimingRing(bytearray(TimingRing.size()))
    for tick in range(1, 6):
        ring.write(tick, -tick, 1, 2, 3, 4, 0)
    assert [row[:2] for row in ring.read(2, 5)] == [(2, -2), (3, -3), (4, -4)]
    assert ring.read(6, 9) == []


def plan(plan_id: int = 7, segments: int = 3) -> Plan:
    rng = np.random.default_rng(1)
    return Plan(
        plan_id=plan_id,
        axes=np.array([6, 7], dtype=np.uint32),
        knots=np.arange(segments + 1, dtype=np.float64),
        coefficients=rng.normal(size=(segments, 4, 2)),
        start=rng.normal(size=2),
        end=rng.normal(size=2),
        rate_codes=np.arange(3 * 4 * 7, dtype=np.uint16).reshape(3, 4, 7),
        rate_limits=rng.normal(size=(4, 2)),
    )


def test_plan_comes_back_to_the_bit() -> None:
    buffer = bytearray(2 * PLAN_SLOT_BYTES)
    written = plan()
    write_plan(buffer, 1, written)
    found = read_plan(buffer, 1, 7)
    for name in ("axes", "knots", "coefficients", "start", "end", "rate_codes", "rate_limits"):
        assert np.array_equal(getattr(found, name), getattr(written, name)), name
    assert found.duration == 3.0


def test_large_plan_is_taken_over_in_pieces() -> None:
    buffer = bytearray(PLAN_SLOT_BYTES)
    write_plan(buffer, 0, plan(segments=5000))
    reader = PlanReader(buffer, 0, 7)
    steps = 1
    while not reader.advance(10_000):
        steps += 1
    assert steps > 10
    assert reader.plan().knots[-1] == 5000.0


def test_damaged_plan_is_refused() -> None:
    buffer = bytearray(PLAN_SLOT_BYTES)
    write_plan(buffer, 0, plan())
    buffer[200] ^= 0x40
    with pytest.raises(PlanError, match="checksum"):
        read_plan(buffer, 0, 7)


def test_another_plan_in_the_slot_is_refused() -> None:
    buffer = bytearray(PLAN_SLOT_BYTES)
    write_plan(buffer, 0, plan(plan_id=8))
    with pytest.raises(PlanError, match="holds plan 8"):
        read_plan(buffer, 0, 7)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(bad: float) -> None:
    buffer = bytearray(PLAN_SLOT_BYTES)
    damaged = plan()
    damaged.coefficients[1, 2, 0] = bad
    write_plan(buffer, 0, damaged)
    with pytest.raises(PlanError, match="not finite"):
        read_plan(buffer, 0, 7)


def test_too_large_a_plan_and_no_such_slot() -> None:
    with pytest.raises(PlanError, match="does not fit"):
        write_plan(bytearray(PLAN_SLOT_BYTES), 0, plan(segments=100_000))
    with pytest.raises(PlanError, match="not one of"):
        offset(32)
