"""What the demo plays, what it makes of a cell file, and what it says at the end."""

import re
import time
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.cell_text import with_files
from axisync_schemas.memory import Control, Word, region_sizes
from axisync_schemas.programs import read_program
from axisync_service.demo import (
    PATIENT,
    EmulatorFailed,
    Extras,
    Program,
    ReviewOfRun,
    next_steps,
    patient,
    program_for,
)
from axisync_service.planner.models import Models
from support.arms import URDF, urdf_cell_text
from support.planner_jobs import CELL, MODELS, REST, TEXT, planned


def strange_cell() -> Cell:
    """A cell that has neither KingKong nor WuKong."""
    joints = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
    return parse_cell(with_files(urdf_cell_text("elbow_arm.urdf", joints), URDF))


def test_a_cell_file_is_made_as_patient_as_it_must_be_and_no_less() -> None:
    cell = parse_cell(patient(TEXT, realtime=True))
    assert (cell.missed_ticks_max, cell.tpdo_missed_max) == (10, PATIENT["tpdo_missed_max"])
    assert parse_cell(patient(TEXT, realtime=False)).missed_ticks_max == PATIENT["missed_ticks_max"]
    longer = TEXT.replace("missed_ticks_max = 5", "missed_ticks_max = 40")
    assert parse_cell(patient(longer, realtime=True)).missed_ticks_max == 40


@pytest.mark.parametrize("realtime", [True, False])
def test_its_programs_are_accepted_one_after_the_other(realtime: bool) -> None:
    """With and without real-time priority: how long drives may go on alone counts when a move is admitted."""
    cell = parse_cell(patient(TEXT, realtime))
    models, rest = Models(cell), list(REST)
    enable, *runs = program_for(cell)
    assert enable == ("enable", "all")
    for _, file, *speed in [*runs, ("run", hint(cell))]:
        program, scale = read_program(Path(file)), 0.5 if speed == ["--speed", "50%"] else 1.0
        axes = cell.axis_indices(program.group)
        start = tuple(rest[i] for i in axes)
        fields = {"group": program.group, "start": start, "rest": tuple(rest), "speed_scale": scale}
        for i, value in zip(axes, planned(program.move, models, **fields).reply.end, strict=True):
            rest[i] = value


def hint(cell: Cell) -> str:
    (file,) = re.findall(r"axisync run (\S+)", next_steps(cell, "tcp/127.0.0.1:7447", Path("logs")))
    return str(file)


def test_a_cell_without_the_papers_arms_is_only_enabled() -> None:
    cell = strange_cell()
    assert program_for(cell) == (("enable", "all"),)
    assert " run " not in next_steps(cell, "tcp/127.0.0.1:7447", Path("logs"))


def test_paths_are_shown_as_they_would_be_typed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = Path(program_for(CELL)[1][1])
    root = file.resolve().parents[3]
    monkeypatch.chdir(root)
    assert program_for(CELL)[1][1] == "service/axisync_service/programs/tool_change.toml"
    monkeypatch.chdir(tmp_path)
    assert Path(program_for(CELL)[1][1]).is_absolute()
    assert MODELS.cell is CELL


def played(program: Program) -> None:
    program.begin()
    deadline = time.monotonic() + 60.0
    while not program.poll():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_the_review_comes_last_whatever_happened_before(capfd: pytest.CaptureFixture[str]) -> None:
    """Commands after one that failed are left out; how the last one ends does not matter."""
    answers: list[tuple[str, ...] | None] = [None, None, ("review", "no-such.mcap")]
    program = Program("tcp/127.0.0.1:1", (("no-such-command",), ("--help",)), lambda: answers.pop(0))
    played(program)
    printed = capfd.readouterr().out
    assert printed.count("$ axisync ") == 2
    assert program.failed == "axisync no-such-command ended with exit code 2"
    assert answers == []


def test_the_log_is_reviewed_once_its_ticks_are_written(tmp_path: Path) -> None:
    """Logs of earlier runs and extracts are not."""
    (tmp_path / "eod-20260101T000000Z.mcap").touch()
    control = Control(bytearray(region_sizes(0.002, 12, 2)["control"]), 2)
    last = ReviewOfRun(control, tmp_path, CELL)
    control[Word.CONTROLLER_TICK] = control[Word.RECORDER_CURSOR] = 500
    new = tmp_path / "eod-20260102T000000Z.mcap"
    new.touch()
    assert last() is None
    control[Word.CONTROLLER_TICK], control[Word.RECORDER_CURSOR] = 900, 501
    assert last() == ("review", str(new))


def test_directories_of_emulators_are_made_or_refused(tmp_path: Path) -> None:
    extras = Extras(candump=tmp_path / "frames" / "today", control=tmp_path / "control")
    extras.make()
    extras.make()
    assert [path.is_dir() for path in (tmp_path / "frames" / "today", tmp_path / "control")] == [True, True]
    taken = tmp_path / "taken"
    taken.touch()
    with pytest.raises(EmulatorFailed, match=rf"the directory {taken}/control cannot be made: Not a directory"):
        Extras(control=taken / "control").make()
