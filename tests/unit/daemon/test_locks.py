"""One daemon a cell and a bus."""

import os
from pathlib import Path

import pytest

from axisync_schemas.cell import parse_cell
from axisync_service.daemon.locks import CannotRun, Locked, Locks, runtime_directory
from support.cells import eod_text

TEXT = eod_text()


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


def test_runtime_directory_that_cannot_be_made_is_refused_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    with pytest.raises(CannotRun, match=r"file/axisync: Not a directory: set XDG_RUNTIME_DIR"):
        runtime_directory()
