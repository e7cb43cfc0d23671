"""Same request, same answer; at once and later."""

from uuid import UUID, uuid4

import pytest

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.actioner.idempotency import KEEP_AT_MOST, KEEP_BYTES, KEEP_NS, Idempotency
from axisync_service.actioner.ports import Answer

KEY = ("anna", UUID(int=1))
DONE = Answer(b"{}", is_error=False)


def test_a_repetition_gets_the_first_answer() -> None:
    known, first, second = Idempotency(), [], []
    assert known.begin(KEY, b"a", first.append, 0)
    known.finish(KEY, DONE)
    assert not known.begin(KEY, b"a", second.append, 1)
    assert first == second == [DONE]


def test_repetitions_during_the_first_wait_for_it() -> None:
    known, answers = Idempotency(), []
    assert known.begin(KEY, b"a", answers.append, 0)
    assert not known.begin(KEY, b"a", answers.append, 1)
    assert answers == []
    known.finish(KEY, DONE)
    assert answers == [DONE, DONE]


def test_refusals_are_kept_too() -> None:
    known, answers = Idempotency(), []
    refused = Answer(b"no", is_error=True)
    known.begin(KEY, b"a", answers.append, 0)
    known.finish(KEY, refused)
    known.begin(KEY, b"a", answers.append, 1)
    assert answers == [refused, refused]


def test_another_body_is_refused_and_harms_nothing() -> None:
    known, answers = Idempotency(), []
    known.begin(KEY, b"a", answers.append, 0)
    with pytest.raises(Refusal) as caught:
        known.begin(KEY, b"b", answers.append, 0)
    assert caught.value.code is ErrorCode.INVALID_REQUEST
    assert caught.value.details["errors"][0]["path"] == "request_id"
    known.finish(KEY, DONE)
    assert answers == [DONE]


def test_users_do_not_share_ids() -> None:
    known, answers = Idempotency(), []
    assert known.begin(KEY, b"a", answers.append, 0)
    assert known.begin(("ben", KEY[1]), b"b", answers.append, 0)


def test_answers_are_kept_ten_minutes() -> None:
    known, answers = Idempotency(), []
    known.begin(KEY, b"a", answers.append, 0)
    known.finish(KEY, DONE)
    assert not known.begin(KEY, b"a", answers.append, KEEP_NS - 1)
    assert known.begin(KEY, b"a", answers.append, KEEP_NS)


def test_no_more_than_ten_thousand_and_none_in_progress_is_forgotten() -> None:
    known, answers = Idempotency(), []
    known.begin(KEY, b"a", answers.append, 0)
    for _ in range(KEEP_AT_MOST + 50):
        key = ("anna", uuid4())
        known.begin(key, b"a", lambda answer: None, 1)
        known.finish(key, DONE)
    assert len(known) <= KEEP_AT_MOST
    assert not known.begin(KEY, b"a", answers.append, KEEP_NS * 3)
    known.finish(KEY, DONE)
    assert answers == [DONE, DONE]


def test_large_answers_make_the_oldest_be_forgotten_earlier() -> None:
    known, large = Idempotency(), Answer(bytes(KEEP_BYTES // 100), is_error=False)
    keys = [("anna", uuid4()) for _ in range(500)]
    for number, key in enumerate(keys):
        answer = DONE if number < 300 else large
        assert known.begin(key, b"a", lambda _: None, number)
        known.finish(key, answer)
    answers: list[Answer] = []
    assert not any(known.begin(key, b"a", answers.append, 500) for key in keys[-99:])
    assert answers == [large] * 99
    assert known.begin(keys[0], b"a", answers.append, 500)
    assert len(known) < 110
