"""Plan slots in turn; token buckets."""

from axisync_service.actioner.rate import RateLimiter
from axisync_service.actioner.slots import Slots


def test_slots_are_used_in_turn() -> None:
    slots = Slots(3)
    assert [slots.take(()) for _ in range(5)] == [0, 1, 2, 0, 1]


def test_referenced_slots_are_skipped_and_come_first_when_free() -> None:
    slots = Slots(3)
    assert slots.take({0}) == 1
    assert slots.take({0}) == 2
    assert slots.take(()) == 0


def test_all_in_use() -> None:
    assert Slots(2).take({0, 1}) is None


def test_a_burst_then_the_rate() -> None:
    limiter = RateLimiter(rate_hz=10.0, burst=3.0)
    assert [limiter.allow("anna", 0) for _ in range(5)] == [True, True, True, False, False]
    assert not limiter.allow("anna", 50_000_000)
    assert limiter.allow("anna", 150_000_000)
    assert not limiter.allow("anna", 150_000_000)


def test_users_have_buckets_of_their_own() -> None:
    limiter = RateLimiter(rate_hz=1.0, burst=1.0)
    assert limiter.allow("anna", 0)
    assert limiter.allow("ben", 0)
    assert not limiter.allow("anna", 0)
