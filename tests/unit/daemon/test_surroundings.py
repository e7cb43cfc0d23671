"""What a run needs before its first process."""

import shutil
import socket
import tempfile
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_service.daemon.locks import CannotRun
from axisync_service.daemon.surroundings import make_surroundings
from support.cells import eod_text

TEXT = eod_text()


def test_a_long_name_of_a_cell_fits_into_the_path_of_a_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    runtime = Path(tempfile.mkdtemp(prefix="axisync-"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    here = make_surroundings(_cell("n" * 64), "")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
        client.connect(str(here.run_dir / "controller.sock"))
    here.close()
    assert list((runtime / "axisync").iterdir()) == []
    shutil.rmtree(runtime)


def test_a_runtime_directory_too_long_for_sockets_is_refused_and_left_clean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runtime = tmp_path / ("long" * 20)
    runtime.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    with pytest.raises(CannotRun, match="AF_UNIX path too long: set XDG_RUNTIME_DIR to another, short path"):
        make_surroundings(_cell("eod"), "")
    assert list((runtime / "axisync").iterdir()) == []


def _cell(name: str) -> Cell:
    return parse_cell(TEXT.replace('name = "eod"', f'name = "{name}"'))
