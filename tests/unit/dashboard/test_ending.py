"""However often and whenever it is told to, the dashboard ends as one that was asked to: with exit code 0."""

import signal
import time
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="NiceGUI is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from support.browser import Dashboard
from support.daemon import free_port

EVERY_S = 0.01
PATIENCE_S = 60.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_signal_after_the_other_ends_it_as_the_first_does(tmp_path: Path, number: signal.Signals) -> None:
    with Dashboard(tmp_path, f"tcp/127.0.0.1:{free_port()}").running() as dashboard:
        end = time.monotonic() + PATIENCE_S
        while dashboard.process.poll() is None and time.monotonic() < end:
            dashboard.process.send_signal(number)
            time.sleep(EVERY_S)
        assert dashboard.process.poll() == 0, dashboard.output
        assert "Traceback" not in dashboard.output, dashboard.output
