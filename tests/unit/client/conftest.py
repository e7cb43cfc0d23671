import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from axisync_client import Client

sys.path.insert(0, str(Path(__file__).parent))  # for cell_peer

from cell_peer import Peer


@pytest.fixture(autouse=True)
def _no_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("AXISYNC_ENDPOINT", "AXISYNC_CELL", "AXISYNC_USER"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def peer() -> Iterator[Peer]:
    running = Peer()
    yield running
    running.close()


@pytest.fixture
def client(peer: Peer) -> Iterator[Client]:
    with Client(peer.endpoint) as connected:
        yield connected
