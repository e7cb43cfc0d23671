from collections.abc import Iterator

import pytest

from axisync_client import Client
from support.cell_peer import Peer


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
