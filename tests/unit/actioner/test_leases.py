"""Leases: one holder a group, tokens, epochs, lapse."""

import itertools

import pytest

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.actioner.leases import Leases

NOW, TTL = 10**12, 2 * 10**9


@pytest.fixture
def leases() -> Leases:
    counter = itertools.count()
    return Leases(("left", "right"), (7, 4), lambda: f"token{next(counter)}")


def code(leases: Leases, token: str | None, groups: tuple[int, ...], now: int = NOW) -> ErrorCode:
    with pytest.raises(Refusal) as caught:
        leases.verify(token, groups, now)
    return caught.value.code


def test_a_lease_proves_itself_by_its_token(leases: Leases) -> None:
    lease = leases.acquire("anna", (0, 1), TTL, NOW)
    assert leases.verify(lease.token, (1,), NOW) is lease
    assert leases.holder(0, NOW) is lease


def test_epochs_grow_above_all_earlier_ones(leases: Leases) -> None:
    assert leases.acquire("anna", (1,), TTL, NOW).epoch == 8
    assert leases.acquire("ben", (0,), TTL, NOW).epoch == 9


def test_held_names_the_holder(leases: Leases) -> None:
    leases.acquire("anna", (0,), TTL, NOW)
    with pytest.raises(Refusal) as caught:
        leases.acquire("ben", (0, 1), TTL, NOW)
    assert caught.value.code is ErrorCode.LEASE_HELD
    assert caught.value.details["holder"] == "anna"
    assert caught.value.details["expires_in_s"] == 2.0
    assert leases.holder(1, NOW) is None


def test_without_a_token(leases: Leases) -> None:
    assert code(leases, None, (0,)) is ErrorCode.LEASE_REQUIRED


def test_a_token_that_never_was(leases: Leases) -> None:
    leases.acquire("anna", (0,), TTL, NOW)
    assert code(leases, "guess", (0,)) is ErrorCode.LEASE_FENCED


def test_a_lease_covers_its_groups_only(leases: Leases) -> None:
    lease = leases.acquire("anna", (0,), TTL, NOW)
    assert code(leases, lease.token, (0, 1)) is ErrorCode.LEASE_REQUIRED


def test_take_fences_the_old_token_and_leaves_the_rest(leases: Leases) -> None:
    old = leases.acquire("anna", (0, 1), TTL, NOW)
    new, losers = leases.take("ben", (0,), TTL, NOW)
    assert losers == [old]
    assert new.epoch == old.epoch + 1
    assert code(leases, old.token, (0,)) is ErrorCode.LEASE_REQUIRED
    assert leases.verify(old.token, (1,), NOW) is old
    leases.take("ben", (1,), TTL, NOW)
    assert code(leases, old.token, (1,)) is ErrorCode.LEASE_FENCED


def test_lapse_is_final_even_before_it_is_noticed(leases: Leases) -> None:
    lease = leases.acquire("anna", (0,), TTL, NOW)
    assert leases.verify(lease.token, (0,), NOW + TTL - 1) is lease
    assert code(leases, lease.token, (0,), NOW + TTL) is ErrorCode.LEASE_FENCED
    assert leases.holder(0, NOW + TTL) is None
    leases.acquire("ben", (0,), TTL, NOW + TTL)


def test_lapse_reports_each_lease_once(leases: Leases) -> None:
    lease = leases.acquire("anna", (0, 1), TTL, NOW)
    assert leases.lapse(NOW + TTL - 1) == []
    assert leases.lapse(NOW + TTL) == [lease]
    assert leases.lapse(NOW + TTL) == []


def test_renew_prolongs_all_groups_of_the_lease(leases: Leases) -> None:
    lease = leases.acquire("anna", (0, 1), TTL, NOW)
    leases.renew(lease.token, (0,), TTL, NOW + TTL - 1)
    assert leases.lapse(NOW + 2 * TTL - 2) == []
    assert leases.verify(lease.token, (1,), NOW + 2 * TTL - 2) is lease


def test_release_gives_back_the_groups_named(leases: Leases) -> None:
    lease = leases.acquire("anna", (0, 1), TTL, NOW)
    leases.release(lease.token, (0,), NOW)
    leases.acquire("ben", (0,), TTL, NOW)
    assert leases.verify(lease.token, (1,), NOW) is lease
    leases.release(lease.token, (1,), NOW)
    assert code(leases, lease.token, (1,)) is ErrorCode.LEASE_FENCED


def test_real_tokens_are_long_and_differ() -> None:
    leases = Leases(("left", "right"), (0, 0))
    tokens = {leases.acquire("anna", (group,), TTL, NOW).token for group in (0, 1)}
    assert len(tokens) == 2
    assert min(map(len, tokens)) >= 32
