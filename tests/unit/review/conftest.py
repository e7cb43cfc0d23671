from pathlib import Path

import pytest

from axisync_cli.main import main
from support.command_line import Outcome, Run
from support.saved_log import STOP_TICK, Maker


@pytest.fixture
def make(tmp_path: Path) -> Maker:
    return Maker(tmp_path)


@pytest.fixture(scope="session")
def good_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log that nobody changes."""
    return Maker(tmp_path_factory.mktemp("good")).write()


@pytest.fixture(scope="session")
def stopped_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its move was stopped on the path."""
    return Maker(tmp_path_factory.mktemp("stopped")).write(STOP_TICK)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs one command line in this process."""
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.delenv("AXISYNC_DEBUG", raising=False)

    def execute(*words: object) -> Outcome:
        capfd.readouterr()
        code = main([str(word) for word in words])
        captured = capfd.readouterr()
        return Outcome(code, captured.out, captured.err)

    return execute
