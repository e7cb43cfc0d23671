"""What people read, and what of it is sent again."""

import math

import pytest

from axisync_client import Refused
from axisync_dashboard import words
from axisync_dashboard.texts import changes
from axisync_schemas.errors import ErrorBody, ErrorCode


@pytest.mark.parametrize(
    ("radians", "text"), [(math.pi / 2, "90.00"), (-1e-9, "0.00"), (None, words.MISSING), (math.nan, words.MISSING)]
)
def test_degrees(radians: float | None, text: str) -> None:
    assert words.degrees(radians) == text


def test_an_error_is_one_sentence_with_its_fix() -> None:
    refusal = Refused(ErrorBody(code=ErrorCode.NOT_ENABLED, message="kingkong is disabled"))
    assert words.of_error(refusal) == "kingkong is disabled: enable it first."
    said = Refused(ErrorBody(code=ErrorCode.BUSY, message="it moves.", details={"fix": "wait"}))
    assert words.of_error(said) == "it moves: wait."


@pytest.mark.parametrize("value", [None, math.nan, math.inf, "3"])
def test_what_is_no_number_is_named(value: float | None) -> None:
    with pytest.raises(ValueError, match=r"^b: enter a number\.$"):
        words.numbers([1.0, value], ["a", "b"])
    assert words.numbers([1, 2.5], ["a", "b"]) == [1.0, 2.5]


def test_only_changes_are_sent_and_what_is_gone_is_emptied() -> None:
    before = {"a": "1", "b": "2", "c": "3"}
    now = {"a": "1", "b": "4", "d": "5"}
    assert changes(before, now) == {"b": "4", "c": "", "d": "5"}
    assert changes(now, now) == {}
