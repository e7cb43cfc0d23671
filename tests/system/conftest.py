"""System tests start the real processes."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from support.daemon import Daemon, running


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Everything in this folder is a system test."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.system)


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    """A fresh daemon for one test, on drives that outlive it."""
    with running(tmp_path, drives_apart=True) as running_daemon:
        yield running_daemon
