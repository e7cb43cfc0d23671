"""What is kept about homes: written when the controller says so, read back, never in the way."""

from dataclasses import replace
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.internal import CONTROLLER_STATUS, ControllerStatus, DriveStatus
from axisync_schemas.memory import STATUS_BYTES, Control, Mailbox, Word
from axisync_service.daemon.homed import HomedFile, state_directory
from support.cells import eod_text

TEXT = eod_text()
HOMING = TEXT.replace("drive = { node_id = 2,", "drive = { homing = { method = 37 }, node_id = 2,", 1)


class Memory:
    """What the controller shows."""

    def __init__(self, cell: Cell) -> None:
        self.control = Control(bytearray(Control.size(2)), 2)
        self.status = Mailbox(bytearray(STATUS_BYTES))
        self._axes = len(cell.axes)

    def show(self, homed: bool | None, serial: int, changes: int, announced: int | None = None) -> None:
        """Status first or counter first: the file must become right in the end."""
        plain = DriveStatus(state=2, nmt=5, statusword=0, error_code=0, error=None)
        drive = replace(plain, homed=homed, serial=serial)
        drives = (plain, drive, *[plain] * (self._axes - 2))
        status = ControllerStatus(
            tick=1, now_ns=0, groups=(), drives=drives, buses=(), skipped_ticks=0, homed_changes=changes
        )
        self.status.write(CONTROLLER_STATUS.dump_json(status))
        self.control[Word.HOMED_CHANGES] = changes if announced is None else announced


@pytest.fixture(autouse=True)
def _place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def test_a_home_outlives_the_service_until_it_is_lost() -> None:
    cell = parse_cell(HOMING)
    memory, file = Memory(cell), HomedFile(cell)
    assert file.read() == {}
    memory.show(True, 77, changes=1)
    file.follow(memory.control, memory.status)
    assert HomedFile(cell).read() == {"kingkong.2": 77}
    memory.show(False, 77, changes=2)
    file.follow(memory.control, memory.status)
    assert HomedFile(cell).read() == {}


def test_a_status_older_than_the_change_is_not_the_last_word() -> None:
    cell = parse_cell(HOMING)
    memory, file = Memory(cell), HomedFile(cell)
    memory.show(False, 77, changes=0, announced=1)
    file.follow(memory.control, memory.status)
    memory.show(True, 77, changes=1)
    file.follow(memory.control, memory.status)
    assert file.read() == {"kingkong.2": 77}


def test_without_a_change_nothing_is_written() -> None:
    cell = parse_cell(HOMING)
    memory, file = Memory(cell), HomedFile(cell)
    memory.show(True, 77, changes=0)
    file.follow(memory.control, memory.status)
    assert not state_directory().exists()


def test_a_cell_without_homing_leaves_no_file() -> None:
    cell = parse_cell(TEXT)
    memory, file = Memory(cell), HomedFile(cell)
    memory.show(None, 77, changes=3)
    file.follow(memory.control, memory.status)
    assert not state_directory().exists()
    assert file.read() == {}


@pytest.mark.parametrize("content", ["", "[1]", '{"kingkong.2": "no"}', "\0"])
def test_a_damaged_file_means_not_homed(content: str) -> None:
    cell = parse_cell(HOMING)
    state_directory().mkdir()
    (state_directory() / "eod.homed.json").write_text(content, encoding="utf-8")
    assert HomedFile(cell).read() == {}


def test_a_directory_that_cannot_be_written_is_no_exception(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "axisync").write_text("a file, where the directory should be", encoding="utf-8")
    cell = parse_cell(HOMING)
    memory, file = Memory(cell), HomedFile(cell)
    memory.show(True, 77, changes=1)
    file.follow(memory.control, memory.status)
    (tmp_path / "axisync").unlink()
    file.follow(memory.control, memory.status)
    assert file.read() == {"kingkong.2": 77}


def test_systemd_says_where() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("STATE_DIRECTORY", "/var/lib/axisync:/other")
        assert state_directory() == Path("/var/lib/axisync")
