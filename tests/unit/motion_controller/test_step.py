"""Decisions of the cycle: enabling, playing, stopping, faults, leases, skipped ticks. No bus, no clock."""

import math

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
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
P2 = [math.radians(x) for x in (100, -90, -60, -120, 45, 45)]
PLANS = bytearray(2 * PLAN_SLOT_BYTES)


@pytest.fixture
def bench() -> Bench:
    cell = parse_cell(TEXT)
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    bench.run(2)
    return bench


def enable(bench: Bench, group: str = "all") -> None:
    bench.commands = [GroupCommand(op="enable", ref=1, group=group)]
    bench.run(60)
    assert bench.replies.pop(1) is None


def begin(
    bench: Bench, group: str = "kingkong", target: list[float] | None = None, slot: int = 0, ref: int = 2
) -> None:
    indices = bench.cell.axis_indices(group)
    start = [bench.core.current.position[i] for i in indices]
    plan = joint_plan(bench.cell, group, start, target or P2 * (len(indices) // 6), plan_id=ref)
    write_plan(PLANS, slot, plan)
    members = bench.cell.members(group)
    epochs = tuple(bench.epochs[m] for m in members)
    stops = tuple(bench.stops[m] for m in members)
    bench.commands = [BeginCommand(ref=ref, group=group, plan_id=ref, slot=slot, epochs=epochs, stop_counts=stops)]
    bench.run()


def states(bench: Bench) -> list[GroupState]:
    return [group.state for group in bench.core.groups]


def refusal(bench: Bench, ref: int) -> ErrorBody:
    error = bench.replies.pop(ref)
    assert isinstance(error, ErrorBody)
    return error


def test_nothing_moves_before_enable(bench: Bench) -> None:
    assert states(bench) == [GroupState.DISABLED, GroupState.DISABLED]
    begin(bench)
    assert refusal(bench, 2).code is ErrorCode.WRONG_STATE


def test_enable_holds_the_actual_position_until_the_brakes_are_open(bench: Bench) -> None:
    bench.commands = [GroupCommand(op="enable", ref=1, group="kingkong")]
    bench.run(20)
    assert 1 not in bench.replies
    assert bench.core.groups[0].all_enabled
    bench.run(30)
    assert bench.replies == {1: None}
    assert states(bench) == [GroupState.STANDSTILL, GroupState.DISABLED]
    rows = np.array([row[0][:6] for row in bench.rows[-40:]])
    assert np.ptp(rows, axis=0).max() == 0.0


def test_move_takes_the_papers_time_and_ends_on_the_target(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    assert bench.replies.pop(2) is None
    began = len(bench.rows)
    bench.run(2700)
    assert states(bench) == [GroupState.STANDSTILL, GroupState.STANDSTILL]
    assert bench.core.current.position[:6].tolist() == P2
    moving = [row for row in bench.rows[began - 1 :] if any(row[1][:6])]
    # At rest at both ends; the start is a whole count, so the last tick may fall just inside the move.
    assert len(moving) in (2624, 2625)
    assert bench.kinds()[-2:] == ["group_state", "move_ended"]


def test_both_arms_end_in_one_tick(bench: Bench) -> None:
    enable(bench)
    begin(bench, "both", target=[*P2, *[math.radians(x) for x in (10, -70, -50, -60, 90, 5)]])
    bench.run(2700)
    velocities = np.array([row[1] for row in bench.rows])
    last = [int(np.flatnonzero(velocities[:, axis])[-1]) for axis in range(12) if axis not in (5, 9, 10)]
    assert len(set(last)) == 1


def test_stop_keeps_the_path_and_the_stop_limits(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.stops[0] += 1
    began = len(bench.rows)
    bench.run(1)
    assert states(bench)[0] is GroupState.STOPPING
    bench.run(800)
    assert states(bench)[0] is GroupState.STANDSTILL
    ended = [event for event in bench.events if event.kind.value == "move_ended"][-1]
    assert ended.details["status"] == "stopped"
    a = np.array([row[2][:6] for row in bench.rows[began:]])
    j = np.array([row[3][:6] for row in bench.rows[began:]])
    assert np.degrees(np.abs(a).max()) <= 60 * (1 + 1e-9)
    assert np.degrees(np.abs(j).max()) <= 240 * (1 + 1e-9)
    q = np.array([row[0][:6] for row in bench.rows])
    assert np.abs(np.diff(q[began:], axis=0)).max() <= math.radians(30) * 0.002 * (1 + 1e-9)


def test_a_stop_that_came_before_begin_wins(bench: Bench) -> None:
    enable(bench)
    bench.stops[0] += 1
    indices = bench.cell.axis_indices("kingkong")
    write_plan(PLANS, 0, joint_plan(bench.cell, "kingkong", [bench.core.current.position[i] for i in indices], P2, 9))
    bench.commands = [BeginCommand(ref=9, group="kingkong", plan_id=9, slot=0, epochs=(1,), stop_counts=(0,))]
    bench.run(3)
    assert "stopped meanwhile" in refusal(bench, 9).message
    assert states(bench)[0] is GroupState.STANDSTILL


@pytest.mark.parametrize("how", ["lease", "front"])
def test_without_lease_or_front_the_move_is_held(bench: Bench, how: str) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    if how == "lease":
        bench.leases[0] = bench.now_ns
    else:
        bench.front = False
    bench.run(2)
    assert states(bench)[0] is GroupState.STOPPING
    bench.run(800)
    assert states(bench)[0] is GroupState.HELD
    bench.leases[0], bench.front = 2**62, True
    bench.run(100)
    assert states(bench)[0] is GroupState.HELD, "nothing resumes by itself"
    bench.stops[0] += 1
    bench.run(1)
    assert states(bench)[0] is GroupState.STANDSTILL
    begin(bench, ref=3)
    assert bench.replies.pop(3) is None


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda b: b.epochs.__setitem__(0, 2), ErrorCode.LEASE_FENCED),
        (lambda b: b.leases.__setitem__(0, 0), ErrorCode.LEASE_REQUIRED),
        (lambda b: setattr(b, "front", False), ErrorCode.LEASE_REQUIRED),
        (lambda b: setattr(b, "stopping", True), ErrorCode.UNAVAILABLE),
    ],
)
def test_begin_is_checked_at_the_last_border(bench: Bench, spoil, code: ErrorCode) -> None:  # type: ignore[no-untyped-def]
    enable(bench)
    start = [bench.core.current.position[i] for i in bench.cell.axis_indices("kingkong")]
    write_plan(PLANS, 0, joint_plan(bench.cell, "kingkong", start, P2, 5))
    spoil(bench)
    bench.commands = [BeginCommand(ref=5, group="kingkong", plan_id=5, slot=0, epochs=(1,))]
    bench.run(2)
    assert refusal(bench, 5).code is code


def test_plan_must_begin_at_the_setpoint(bench: Bench) -> None:
    enable(bench)
    start = [bench.core.current.position[i] + 1e-6 for i in bench.cell.axis_indices("kingkong")]
    write_plan(PLANS, 0, joint_plan(bench.cell, "kingkong", start, P2, 6))
    bench.commands = [BeginCommand(ref=6, group="kingkong", plan_id=6, slot=0, epochs=(1,))]
    bench.run(2)
    assert "does not begin at the setpoint" in refusal(bench, 6).message


def test_drive_fault_stops_the_whole_motion_and_latches_its_group(bench: Bench) -> None:
    enable(bench)
    begin(bench, "both")
    bench.run(1000)
    bench.drives[2].state = DriveState.FAULT
    bench.run(1)
    assert states(bench) == [GroupState.STOPPING, GroupState.STOPPING]
    bench.run(800)
    assert states(bench) == [GroupState.FAULT, GroupState.STANDSTILL]
    bench.run(20)
    assert not any(drive.state is DriveState.OPERATION_ENABLED for drive in bench.drives[:6])
    assert all(drive.state is DriveState.OPERATION_ENABLED for drive in bench.drives[6:])
    bench.commands = [GroupCommand(op="enable", ref=7, group="kingkong")]
    bench.run()
    assert refusal(bench, 7).code is ErrorCode.FAULTED
    bench.commands = [GroupCommand(op="reset", ref=8, group="kingkong")]
    bench.run(30)
    assert bench.replies.pop(8) is None
    assert states(bench)[0] is GroupState.DISABLED
    enable(bench, "kingkong")


def test_faulted_axis_is_told_to_quick_stop(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.drives[1].stuck = True
    bench.run(200)
    assert "drive_fault" in bench.kinds()
    fault = next(event for event in bench.events if event.kind.value == "drive_fault")
    assert "has not changed" in fault.message
    assert bench.drives[1].state is DriveState.SWITCH_ON_DISABLED
    assert bench.drives[0].state is DriveState.OPERATION_ENABLED


def test_silent_drive_is_a_fault_after_three_ticks(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(500)
    bench.drives[4].silent = True
    bench.run(2)
    assert states(bench)[0] is GroupState.MOVING
    bench.run(1)
    assert states(bench)[0] is GroupState.STOPPING


def test_few_skipped_ticks_keep_the_grid(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.run(1, skipped=5)
    assert states(bench)[0] is GroupState.MOVING
    q = np.array([row[0][:6] for row in bench.rows[-10:]])
    assert np.abs(np.diff(q, n=3, axis=0)).max() / 0.002**3 <= math.radians(80) * 1.01, "no jump over the skipped ticks"


def test_too_many_skipped_ticks_are_a_fault(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.run(1, skipped=6)
    assert states(bench) == [GroupState.FAULT, GroupState.FAULT]
    assert "ticks_overrun" in bench.kinds()
    bench.run(20)
    assert not any(drive.state is DriveState.OPERATION_ENABLED for drive in bench.drives)


def test_hold_drives_stop_at_the_first_skipped_tick() -> None:
    cell = parse_cell(TEXT.replace('on_missed = "extrapolate"', 'on_missed = "hold"', 1))
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    bench.run(2)
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.run(1, skipped=1)
    assert states(bench)[0] is GroupState.STOPPING


def test_disable_stops_on_the_path_first(bench: Bench) -> None:
    enable(bench)
    begin(bench)
    bench.run(1000)
    bench.commands = [GroupCommand(op="disable", ref=4, group="kingkong")]
    bench.run(2)
    assert states(bench)[0] is GroupState.STOPPING
    assert 4 not in bench.replies
    bench.run(800)
    assert states(bench)[0] is GroupState.DISABLED
    assert bench.replies.pop(4) is None


def test_end_of_the_service_stops_and_disables(bench: Bench) -> None:
    enable(bench)
    begin(bench, "both")
    bench.run(1000)
    bench.stopping = True
    bench.run(5)
    assert states(bench) == [GroupState.STOPPING, GroupState.STOPPING]
    bench.run(1000)
    assert bench.core.shut_down
    assert not any(drive.state is DriveState.OPERATION_ENABLED for drive in bench.drives)


def test_unknown_group_and_damaged_plan(bench: Bench) -> None:
    bench.commands = [GroupCommand(op="enable", ref=1, group="nobody")]
    bench.run()
    assert refusal(bench, 1).code is ErrorCode.NOT_FOUND
    bench.commands = [BeginCommand(ref=2, group="kingkong", plan_id=77, slot=1, epochs=(1,))]
    bench.run()
    assert refusal(bench, 2).code is ErrorCode.INTERNAL
