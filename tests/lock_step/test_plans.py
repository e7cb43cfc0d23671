"""The real cycle and the real emulator without a real clock: plans from a file, twice the same, to the bit."""

import math
from pathlib import Path

import numpy as np

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_service.mapper.counts import CountMap
from support.cells import eod_text
from support.lock_step import Run, as_log, emulated, play
from support.plans import joint_plan

TARGET = [math.radians(x) for x in (5, -148, 58, -46, -45, 44)]


def run(directory: Path) -> Run:
    directory.mkdir()
    cell_file = directory / "cell.toml"
    cell_file.write_text(eod_text(), encoding="utf-8")
    cell = parse_cell(eod_text()).on_simcan(str(directory))
    counts = CountMap(cell.axes[:6])
    start = counts.to_position(counts.to_counts(np.array([axis.drive.start for axis in cell.axes[:6]])))
    with emulated(cell_file, directory):
        return play(cell, [as_log(joint_plan(cell, "kingkong", list(start), TARGET), "kingkong")])


def test_a_plan_from_a_file_is_played_and_the_drives_follow(tmp_path: Path) -> None:
    done = run(tmp_path / "a")
    assert done.failure is None
    kinds = [event.kind.value for event in done.happenings]
    assert kinds.count("drive_ready") == 12
    assert "move_ended" in kinds
    assert not done.records["skipped"].any()
    assert (done.records["lateness_ns"] == 0).all()
    states = done.records["group_state"][:, 0]
    standing = done.records[states == GroupState.STANDSTILL]
    assert standing["position"][-1][:6].tolist() == TARGET
    moving = done.records[states == GroupState.MOVING]
    following = np.abs(moving["position"] - moving["position_actual"]).max()
    assert following < math.radians(0.5)
    assert states[-1] == GroupState.DISABLED


def test_two_runs_are_the_same_to_the_bit(tmp_path: Path) -> None:
    first, second = run(tmp_path / "a"), run(tmp_path / "b")
    names = [name for name in first.records.dtype.names or () if name != "cycle_start_ns"]
    for name in names:
        assert np.array_equal(first.records[name], second.records[name]), name
    assert [event.message for event in first.happenings] == [event.message for event in second.happenings]
