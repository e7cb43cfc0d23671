import pytest

from axisync_cli import foxglove_command
from support.command_line import Run


def test_without_the_extra_it_says_what_to_install(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foxglove_command, "find_spec", lambda name: None)
    assert run("foxglove").code == 1
    assert run("foxglove").err == ("the live view for Foxglove needs its SDK: pip install 'axisync[foxglove]'\n")
