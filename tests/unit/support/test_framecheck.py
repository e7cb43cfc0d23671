"""The frame checker finds what is wrong on a bus, and nothing where frames and log agree."""

from functools import cache
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, read_cell
from support import framecheck
from support.framecheck import Frame
from support.logread import Log
from support.recording import CELL
from support.synthetic import Session, candump


@cache
def cell() -> Cell:
    return read_cell(CELL)[0]


@cache
def session() -> Session:
    return Session(cell(), "both", None, 0.05)


@pytest.fixture
def log() -> Log:
    return session().log()


@pytest.fixture
def frames(tmp_path: Path, log: Log) -> list[Frame]:
    candump(log, tmp_path / "can.log")
    return list(framecheck.parse(tmp_path / "can.log"))


def problems(log: Log, frames: list[Frame]) -> list[str]:
    return framecheck.problems(log, framecheck.collect(log.cell, frames))


def where(frames: list[Frame], can_id: int, number: int, bus: str = "kingkong") -> int:
    """Index of the number-th frame of an identifier."""
    return [i for i, f in enumerate(frames) if f.can_id == can_id and f.interface == bus][number]


def changed(frame: Frame, data: bytes) -> Frame:
    return Frame(frame.at, frame.interface, frame.can_id, data)


def moved(frame: Frame, counts: int) -> Frame:
    target = int.from_bytes(frame.data[2:], "little", signed=True) + counts
    return changed(frame, frame.data[:2] + target.to_bytes(4, "little", signed=True))


def test_frames_and_log_that_agree(log: Log, frames: list[Frame]) -> None:
    assert problems(log, frames) == []
    bus = framecheck.collect(log.cell, frames)["wukong"]
    assert bus.axes == (6, 7, 8, 9, 10, 11)
    assert bus.ticks.tolist() == log.ticks["tick"].tolist()
    assert len(log.ticks) > 480  # The counter has wrapped twice.


def test_a_target_two_counts_off(log: Log, frames: list[Frame]) -> None:
    at = where(frames, 0x203, 100)
    frames[at] = moved(frames[at], 1)
    assert problems(log, frames) == []
    frames[at] = moved(frames[at], 1)
    found = problems(log, frames)
    assert found
    assert all("tick 102, kingkong.3" in problem for problem in found)


def test_targets_of_the_other_arm(log: Log, frames: list[Frame]) -> None:
    other = {"kingkong": "wukong", "wukong": "kingkong"}
    swapped = [Frame(f.at, other[f.interface], f.can_id, f.data) for f in frames]
    assert len(problems(log, swapped)) > 10


def test_a_target_that_comes_after_its_sync(log: Log, frames: list[Frame]) -> None:
    target, sync = where(frames, 0x201, 200), where(frames, 0x080, 201)
    assert target < sync
    frames.insert(sync, frames.pop(target))
    assert any("tick 202, kingkong.1: frame has" in problem for problem in problems(log, frames))


def test_a_sync_left_out_and_one_sent_twice(log: Log, frames: list[Frame]) -> None:
    without = list(frames)
    del without[where(frames, 0x080, 300)]
    assert "kingkong: no SYNC at tick 301" in problems(log, without)
    at = where(frames, 0x080, 300)
    frames.insert(at, frames[at])
    assert problems(log, frames) == ["kingkong: SYNC counter 3d twice, after tick 301"]


def test_the_bus_without_any_sync(log: Log, frames: list[Frame]) -> None:
    assert problems(log, [f for f in frames if f.interface == "wukong"]) == ["kingkong: no SYNC"]


def test_skipped_ticks_have_no_sync_and_leave_the_first_of_their_setpoints(log: Log, tmp_path: Path) -> None:
    row = 200
    log.ticks["skipped"][row : row + 3] = 1
    candump(log, tmp_path / "can.log")
    frames = list(framecheck.parse(tmp_path / "can.log"))
    assert problems(log, frames) == []
    log.ticks["skipped"][row] = 0
    assert "kingkong: no SYNC at tick 201" in problems(log, frames)
    log.ticks["skipped"][row : row + 4] = 1
    assert "kingkong: a SYNC at tick 204, which the log calls skipped or lacks" in problems(log, frames)


def test_more_skipped_ticks_than_the_counter_counts(log: Log, tmp_path: Path) -> None:
    log.ticks["skipped"][100:400] = 1
    candump(log, tmp_path / "can.log")
    bus = framecheck.collect(log.cell, list(framecheck.parse(tmp_path / "can.log")))["kingkong"]
    assert bus.ticks[99:101].tolist() == [100, 401]


def test_a_dump_that_begins_late_needs_the_first_tick(log: Log, frames: list[Frame]) -> None:
    late = frames[where(frames, 0x080, 300) :]
    assert framecheck.problems(log, framecheck.collect(log.cell, late, first_tick=301)) == []
    assert framecheck.problems(log, framecheck.collect(log.cell, late)) != []


def test_a_jump_on_the_bus_and_in_the_log_is_a_velocity(log: Log, tmp_path: Path) -> None:
    log.ticks["target_counts"][150:, 8] += 2000
    candump(log, tmp_path / "can.log")
    frames = framecheck.collect(log.cell, list(framecheck.parse(tmp_path / "can.log")))
    found = framecheck.velocity_problems(log, frames["wukong"])
    assert len(found) == 1
    assert "tick 151, wukong.3: the target moves" in found[0]


def test_targets_wrap_at_32_bits(log: Log, tmp_path: Path) -> None:
    """As a multi-turn axis far from its zero: only differences matter."""
    log.ticks["target_counts"][:] = (log.ticks["target_counts"].astype("i8") + 2**31 + 2**31) % 2**32 - 2**31
    far = 2**31 - 20
    log.ticks["target_counts"][:, 0] = (log.ticks["target_counts"][:, 0].astype("i8") + far + 2**31) % 2**32 - 2**31
    candump(log, tmp_path / "can.log")
    frames = framecheck.collect(log.cell, list(framecheck.parse(tmp_path / "can.log")))
    assert framecheck.velocity_problems(log, frames["kingkong"]) == []


def test_a_drive_that_is_never_told(log: Log, frames: list[Frame]) -> None:
    silent = [f for f in frames if (f.interface, f.can_id) != ("kingkong", 0x204)]
    assert problems(log, silent) == ["kingkong: kingkong.4 has no target at tick 2"]


def test_an_rpdo_of_another_length(log: Log, frames: list[Frame]) -> None:
    at = where(frames, 0x202, 50)
    frames[at] = changed(frames[at], frames[at].data[:4])
    assert "kingkong: RPDO 0x202 of 4 bytes" in problems(log, frames)


def test_candump_lines(tmp_path: Path) -> None:
    path = tmp_path / "can.log"
    path.write_text("(1700000000.000100) vcan0 080#01\n(1700000000.000200) vcan0 18FF0001#\n(17000000")
    assert list(framecheck.parse(path)) == [
        Frame(1700000000.0001, "vcan0", 0x80, b"\x01"),
        Frame(1700000000.0002, "vcan0", 0x18FF0001, b""),
    ]
    path.write_text("garbage\n(1700000000.000100) vcan0 080#01\n")
    with pytest.raises(AssertionError, match="is no candump line"):
        list(framecheck.parse(path))


def test_names_of_a_bus() -> None:
    assert framecheck.interfaces(cell())["vcan1"] == "wukong"
    assert framecheck.interfaces(cell().on_simcan("/run/x"))["/run/x/kingkong.sock"] == "kingkong"
