"""Shell completion, as the shells ask for it."""

import os
import subprocess
import sys

import pytest


def completed(shell: str, line: str) -> str:
    words = line.split()
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "_AXISYNC_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
        "_TYPER_COMPLETE_ARGS": line,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    command = [sys.executable, "-m", "axisync_cli"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=30, check=False).stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_commands_and_options(shell: str) -> None:
    assert "watch" in completed(shell, "axisync wa")
    assert "--minimise" in completed(shell, "axisync move --mini")


def test_choices() -> None:
    assert completed("bash", "axisync move kingkong --pulse p").split() == ["parabolic"]
