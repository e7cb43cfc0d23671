"""One daemon a cell and a bus."""

import os
from importlib import resources
from pathlib import Path

import pytest

from axisync_schemas.cell import parse_cell
from axisync_service.daemon.locks import Locked, Locks, runtime_directory

TEXT = resources.files("axisync_service").joinpath("cells/eod.toml").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _own_runtime_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def test_second_daemon_of_a_cell_is_refused_with_the_holder() -> None:
    first = Locks(parse_cell(TEXT))
    with pytest.raises(Locked, match=rf"cell eod is already served by process {os.getpid()}"):
        Locks(parse_cell(TEXT))
    first.release()
    Locks(parse_cell(TEXT)).release()


def test_two_cells_cannot_share_a_bus() -> None:
    first = Locks(parse_cell(TEXT))
    with pytest.raises(Locked, match="bus vcan0"):
        Locks(parse_cell(TEXT.replace('name = "eod"', 'name = "other"')))
    first.release()


def test_simulated_buses_are_nobodys_but_the_runs_own() -> None:
    first = Locks(parse_cell(TEXT).on_simcan("/a"))
    second = Locks(parse_cell(TEXT.replace('name = "eod"', 'name = "other"')).on_simcan("/a"))
    first.release()
    second.release()


def test_runtime_directory_is_private() -> None:
    assert runtime_directory().stat().st_mode & 0o077 == 0
