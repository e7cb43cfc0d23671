"""Who may come in, with how much, how often."""

import pytest

from axisync_schemas.commands import MAX_REQUEST_BYTES
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.hmi.door import Door, is_wildcard


def code(key: str) -> ErrorCode:
    with pytest.raises(Refusal) as caught:
        Door().user(key)
    return caught.value.code


def test_anonymous() -> None:
    assert Door().user("axisync/eod/cmd/anonymous/move") == "anonymous"


@pytest.mark.parametrize(
    "key",
    ["axisync/eod/cmd/*/move", "axisync/*/cmd/anonymous/move", "axisync/**", "axisync/eod/cmd/anonymous/*",
     "axisync/eod/cmd/anon$*/move", "**", "axisync/eod/cmd/a b/move", "axisync/eod/cmd/move"],
)  # fmt: skip
def test_wildcards_and_names_that_are_none(key: str) -> None:
    assert code(key) is ErrorCode.INVALID_REQUEST


@pytest.mark.parametrize("user", ["root", "Anonymous", "anonymous.", "anna"])
def test_others(user: str) -> None:
    assert code(f"axisync/eod/cmd/{user}/move") is ErrorCode.NOT_AUTHORISED


def test_size() -> None:
    Door.check_size(MAX_REQUEST_BYTES)
    with pytest.raises(Refusal) as caught:
        Door.check_size(MAX_REQUEST_BYTES + 1)
    assert caught.value.code is ErrorCode.TOO_LARGE
    assert caught.value.details == {"bytes": MAX_REQUEST_BYTES + 1, "allowed": MAX_REQUEST_BYTES}


def test_rate() -> None:
    door = Door()
    for _ in range(500):
        door.check_rate("anonymous", 0)
    with pytest.raises(Refusal) as caught:
        door.check_rate("anonymous", 0)
    assert caught.value.code is ErrorCode.RATE_LIMITED
    door.check_rate("anonymous", 10**9)


def test_wildcards_are_seen() -> None:
    assert is_wildcard("a/*/b")
    assert is_wildcard("a/x$*/b")
    assert not is_wildcard("a/b")
