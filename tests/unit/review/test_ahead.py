"""Work ahead: the same items in the same order, and nothing left behind."""

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest

from axisync_review.ahead import ahead


def _counting(made: list[int], end: int, fault: Exception | None = None) -> Iterator[int]:
    for number in range(end):
        made.append(number)
        yield number
    if fault is not None:
        raise fault


@pytest.mark.parametrize("depth", [1, 2, 50])
def test_the_same_items_in_the_same_order(depth: int) -> None:
    assert list(ahead(_counting([], 30), depth)) == list(range(30))


def test_a_fault_comes_where_it_would_have_come() -> None:
    items = ahead(_counting([], 3, ValueError("torn")), 5)
    assert [next(items) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(ValueError, match="torn"):
        next(items)


def test_no_more_is_made_than_may_wait_and_the_thread_ends() -> None:
    made: list[int] = []
    before = threading.active_count()
    with closing(ahead(_counting(made, 1000), 3)) as items:
        assert next(items) == 0
    assert len(made) <= 1 + 3
    assert threading.active_count() == before
