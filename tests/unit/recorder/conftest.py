"""Recorders in this process."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest

from support.recorder_here import Bench, made


@pytest.fixture
def make_bench(tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    """Makes open ones with settings of the test's own; they are closed afterwards."""
    with ExitStack() as stack:
        yield lambda **settings: stack.enter_context(partial(made, tmp_path)(**settings))


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    """An open one as it is."""
    return make_bench()
