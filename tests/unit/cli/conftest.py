from collections.abc import Iterator

import pytest

from axisync_cli.main import main
from support.cell_peer import Peer
from support.command_line import Outcome, Run


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("AXISYNC_ENDPOINT", "AXISYNC_CELL", "AXISYNC_USER", "AXISYNC_DEBUG", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "100")


@pytest.fixture
def peer() -> Iterator[Peer]:
    running = Peer()
    yield running
    running.close()


@pytest.fixture
def run(peer: Peer, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs one command line against the peer, in this process."""
    monkeypatch.setenv("AXISYNC_ENDPOINT", peer.endpoint)

    def execute(*words: str) -> Outcome:
        capfd.readouterr()
        code = main(words)
        captured = capfd.readouterr()
        return Outcome(code, captured.out, captured.err)

    return execute
