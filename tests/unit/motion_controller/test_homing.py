"""`home`: drives find their homes one after the other or together, stops and failures end it, moves wait for it."""

import math

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import DriveState, GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.internal import BeginCommand, GroupCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_service.motion_controller.step import Core
from support.cells import eod_text
from support.ideal_drive import Bench
from support.plans import joint_plan

TEXT = eod_text()
SPEEDS = "switch_speed_deg_s = 5, zero_speed_deg_s = 1, acceleration_deg_s2 = 20"
HOMING = f"homing = {{ method = 24, {SPEEDS}, timeout_s = 2 }}"
PLANS = bytearray(PLAN_SLOT_BYTES)


def cell_with(homing: str = HOMING, nodes: tuple[int, ...] = (1, 2), together: bool = False) -> Cell:
    """KingKong with some axes to be homed."""
    text = TEXT
    for node in nodes:
        text = text.replace(f"drive = {{ node_id = {node},", f"drive = {{ {homing}, node_id = {node},", 1)
    if together:
        text = text.replace('name = "kingkong"\nbase', 'name = "kingkong"\nhoming_together = true\nbase')
    return parse_cell(text)


def bench_of(cell: Cell, homed: dict[str, int] | None = None) -> Bench:
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id), homed))
    bench.run(2)
    bench.commands = [GroupCommand(op="enable", ref=1, group="kingkong")]
    bench.run(60)
    assert bench.replies.pop(1) is None
    for node in (1, 2):
        bench.drives[node - 1].home_at = bench.drives[node - 1].counts + 200 * node
    return bench


def home(bench: Bench, ticks: int = 1, group: str = "kingkong") -> None:
    bench.commands = [GroupCommand(op="home", ref=5, group=group)]
    bench.run(ticks)


def refusal(bench: Bench, ref: int = 5) -> ErrorBody:
    error = bench.replies.pop(ref)
    assert isinstance(error, ErrorBody)
    return error


def state(bench: Bench) -> GroupState:
    return bench.core.groups[0].state


def begin(bench: Bench) -> object:
    """A move of all axes by a degree; the answer."""
    start = [bench.core.current.position[i] for i in range(6)]
    write_plan(PLANS, 0, joint_plan(bench.cell, "kingkong", start, [q + 0.02 for q in start], plan_id=9))
    stops = (bench.stops[0],)
    bench.commands = [BeginCommand(ref=9, group="kingkong", plan_id=9, slot=0, epochs=(1,), stop_counts=stops)]
    bench.run(2)
    return bench.replies.pop(9)


@pytest.mark.parametrize("together", [False, True])
def test_home_is_found_by_every_drive_and_moves_begin_from_it(together: bool) -> None:
    bench = bench_of(cell_with(together=together))
    error = begin(bench)
    assert isinstance(error, ErrorBody)
    assert error.code is ErrorCode.NOT_HOMED
    assert "kingkong.1, kingkong.2 must be homed" in error.message
    home(bench, 20)
    assert state(bench) is GroupState.HOMING
    seeking = [drive.server.values[0x6060, 0] for drive in bench.drives[:2]]
    assert seeking == [b"\x06", b"\x06" if together else b"\x08"]
    bench.run(300)
    assert bench.replies.pop(5) is None
    assert state(bench) is GroupState.STANDSTILL
    homed = [event.message for event in bench.events if event.kind.value == "axis_homed"]
    assert homed == ["kingkong.1 is homed", "kingkong.2 is homed"]
    assert bench.core.homed_changes == 2
    assert [drive.counts for drive in bench.drives[:2]] == [0, 0]
    assert bench.core.current.position[:2].tolist() == [0.0, 0.0]
    assert bench.drives[0].server.values[0x6060, 0] == b"\x08"
    assert bench.core.drives[0].homed
    assert "drive_fault" not in bench.kinds()
    assert begin(bench) is None
    bench.run(600)
    assert state(bench) is GroupState.STANDSTILL
    assert "drive_fault" not in bench.kinds()
    assert bench.drives[0].counts == round(0.02 * bench.cell.axes[0].drive.counts_per_rad)


def test_what_the_drive_is_told_about_its_homing() -> None:
    bench = bench_of(cell_with())
    home(bench, 100)
    values = bench.drives[0].server.values
    scale = 1048576 / 360
    assert values[0x6098, 0] == b"\x18"
    assert values[0x607C, 0] == b"\0\0\0\0"
    assert int.from_bytes(values[0x6099, 1], "little") == round(5 * scale)
    assert int.from_bytes(values[0x6099, 2], "little") == round(scale)
    assert int.from_bytes(values[0x609A, 0], "little") == round(20 * scale)


def test_while_a_drive_seeks_the_others_keep_their_place() -> None:
    bench = bench_of(cell_with())
    before = bench.core.current.position[1:6].tolist()
    home(bench, 20)
    bench.run(10)
    assert bench.core.current.position[1:6].tolist() == before


@pytest.mark.parametrize("how", ["stop", "lease", "front", "disable"])
def test_stop_and_a_lost_lease_end_it(how: str) -> None:
    bench = bench_of(cell_with())
    home(bench, 20)
    counts = bench.drives[0].counts
    if how == "stop":
        bench.stops[0] += 1
    elif how == "lease":
        bench.leases[0] = bench.now_ns
    elif how == "front":
        bench.front = False
    else:
        bench.commands = [GroupCommand(op="disable", ref=6, group="kingkong")]
    bench.run(2)
    assert state(bench) is GroupState.STOPPING
    bench.run(60)
    error = refusal(bench)
    assert error.code is ErrorCode.WRONG_STATE
    assert "was not homed" in error.message
    assert state(bench) is (GroupState.DISABLED if how == "disable" else GroupState.STANDSTILL)
    assert how != "disable" or bench.replies.pop(6) is None
    assert abs(bench.drives[0].counts - counts) < 50
    assert not bench.core.drives[0].homed
    assert bench.drives[0].server.values[0x6060, 0] == b"\x08"
    assert "drive_fault" not in bench.kinds()


def test_a_homing_error_is_said_and_the_next_axis_is_not_tried() -> None:
    bench = bench_of(cell_with())
    bench.drives[0].homing_fails = True
    home(bench, 100)
    assert "kingkong.1: the drive reports a homing error" in refusal(bench).message
    assert state(bench) is GroupState.STANDSTILL
    assert bench.kinds().count("homing_failed") == 1
    assert bench.drives[1].server.values[0x6098, 0] == b"\0"


def test_a_home_that_is_not_found_in_time() -> None:
    bench = bench_of(cell_with())
    bench.drives[0].home_at = 10**9
    home(bench, 1100)
    assert "home was not found within 2 s" in refusal(bench).message
    assert state(bench) is GroupState.STANDSTILL


def test_an_object_that_the_drive_refuses() -> None:
    bench = bench_of(cell_with())
    bench.drives[0].server.abort = lambda index, sub, writes: 0x06090030 if index == 0x6098 and writes else None
    home(bench, 40)
    assert "0x6098:0 (Homing method) = 24: abort 0x06090030: invalid value for parameter" in refusal(bench).message
    assert state(bench) is GroupState.STANDSTILL


def test_a_drive_lost_while_it_seeks_is_a_fault_and_can_be_enabled_again() -> None:
    bench = bench_of(cell_with())
    home(bench, 20)
    bench.drives[0].silent = True
    bench.run(10)
    assert state(bench) is GroupState.FAULT
    assert refusal(bench).code is ErrorCode.FAULTED
    assert bench.core.groups[0].homing is None
    bench.drives[0].silent = False
    bench.run(20)
    assert bench.drives[0].server.values[0x6060, 0] == b"\x08"


def test_a_drive_that_does_not_come_back_to_csp_is_switched_off() -> None:
    bench = bench_of(cell_with())
    home(bench, 20)
    bench.drives[0].server.abort = lambda index, sub, writes: 0x08000022 if index == 0x6060 and writes else None
    bench.run(700)
    assert state(bench) is GroupState.FAULT
    assert refusal(bench).code is ErrorCode.FAULTED
    bench.run(20)
    assert bench.drives[0].state is not DriveState.OPERATION_ENABLED


@pytest.mark.parametrize(
    ("group", "enabled", "code"),
    [("kingkong", False, ErrorCode.NOT_ENABLED), ("wukong", True, ErrorCode.INVALID_REQUEST)],
)
def test_where_there_is_nothing_to_home(group: str, enabled: bool, code: ErrorCode) -> None:
    bench = bench_of(cell_with())
    if not enabled:
        bench.commands = [GroupCommand(op="disable", ref=2, group="kingkong")]
        bench.run(10)
    home(bench, 2, group)
    assert refusal(bench).code is code


def test_what_an_earlier_run_found_holds_for_the_same_drive_only() -> None:
    cell = cell_with()
    bench = bench_of(cell, {"kingkong.1": 77, "kingkong.2": 77, "kingkong.3": 77})
    assert [drive.needs_homing for drive in bench.core.drives[:3]] == [False, False, False]
    assert begin(bench) is None


@pytest.mark.parametrize("method", [35, 37])
def test_home_where_it_stands_needs_no_speeds(method: int) -> None:
    bench = bench_of(cell_with(f"homing = {{ method = {method} }}"))
    bench.drives[0].home_at = bench.drives[0].counts
    home(bench, 300)
    assert bench.replies.pop(5) is None
    assert bench.core.current.position[0] == 0.0


def test_the_end_of_the_service_ends_it() -> None:
    bench = bench_of(cell_with())
    home(bench, 20)
    bench.stopping = True
    bench.run(200)
    assert bench.core.shut_down
    assert bench.drives[0].state is not DriveState.OPERATION_ENABLED


def test_a_home_far_away_does_not_wrap() -> None:
    """A shift of more than half the counter's range is no jump of the axis."""
    cell = cell_with("gear_ratio = 3000, homing = { method = 37 }", nodes=(1,))
    bench = bench_of(cell)
    home(bench, 300)
    assert bench.replies.pop(5) is None
    assert math.isclose(bench.core.watch.actual_position[0], 0.0, abs_tol=1e-9)
