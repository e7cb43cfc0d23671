"""Actual positions that cannot be true, and drives whose torque is off."""

import math
from itertools import pairwise

import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.internal import BeginCommand, GroupCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_service.motion_controller.step import Core
from support.cells import eod_text
from support.ideal_drive import Bench
from support.plans import joint_plan

TEXT = eod_text()
PLANS = bytearray(PLAN_SLOT_BYTES)


def moving(text: str = TEXT) -> Bench:
    """KingKong in the middle of a move."""
    cell = parse_cell(text)
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    bench.run(2)
    bench.commands = [GroupCommand(op="enable", ref=1, group="all")]
    bench.run(60)
    assert bench.replies.pop(1) is None
    start = [bench.core.current.position[i] for i in range(6)]
    write_plan(PLANS, 0, joint_plan(cell, "kingkong", start, [q + math.radians(30) for q in start], 2))
    bench.commands = [BeginCommand(ref=2, group="kingkong", plan_id=2, slot=0, epochs=(1,), stop_counts=(0,))]
    bench.run(400)
    assert bench.replies.pop(2) is None
    return bench


def reason(bench: Bench) -> str:
    return next(event.message for event in bench.events if event.kind.value == "drive_fault")


def test_a_frozen_position_is_a_fault_within_20_ms() -> None:
    bench = moving()
    bench.drives[2].stuck = True
    bench.run(10)
    assert bench.core.groups[0].state is GroupState.STOPPING
    assert "kingkong.3: its position has not changed" in reason(bench)


def test_a_drive_that_lags_and_moves_is_judged_by_its_following_error() -> None:
    bench = moving()
    drive = bench.drives[2]
    drive.stuck = True
    for _ in range(60):
        drive.counts += 1
        bench.run(1)
    assert "following error" in reason(bench)


def test_a_jump_is_a_fault_at_once() -> None:
    bench = moving()
    drive = bench.drives[2]
    drive.stuck, drive.counts = True, drive.counts + 2000  # 0.7 deg, within the following error window
    bench.run(1)
    assert "kingkong.3: its position jumped by 2000 counts" in reason(bench)
    assert bench.core.groups[0].quick_stop == {2}


def test_a_step_over_skipped_ticks_is_no_jump() -> None:
    bench = moving()
    bench.run(150)  # at full speed
    for drive in bench.drives:  # what is read now was sampled before the gap
        drive.stuck = True
    bench.run(1, skipped=5)
    before = bench.drives[2].counts
    for drive in bench.drives:
        drive.stuck = False
    bench.run(1)
    assert bench.drives[2].counts - before > 1000
    assert "drive_fault" not in bench.kinds()


def test_nothing_is_suspected_at_standstill_and_after_enabling() -> None:
    bench = moving()
    bench.run(1500)
    bench.commands = [GroupCommand(op="disable", ref=3, group="all")]
    bench.run(10)
    for drive in bench.drives:  # moved by hand
        drive.counts += 100
    bench.run(1)
    bench.commands = [GroupCommand(op="enable", ref=4, group="all")]
    bench.run(200)
    assert bench.replies.pop(4) is None
    assert "drive_fault" not in bench.kinds()


def test_a_move_across_the_end_of_the_counter_has_no_jump() -> None:
    offset = math.degrees(2**31 / (1048576 / (2 * math.pi)))
    text = TEXT.replace("drive = { node_id = 1,", f"drive = {{ offset_deg = {15 - offset}, node_id = 1,", 1)
    bench = moving(text)
    bench.run(1500)
    assert "drive_fault" not in bench.kinds()
    counts = bench.drives[0].counts
    assert counts < -(2**30), "it has wrapped"
    q = [row[0][0] for row in bench.rows]
    assert max(abs(b - a) for a, b in pairwise(q)) < math.radians(30) * 0.002 * 1.01
    assert math.isclose(q[-1], math.radians(30), abs_tol=1e-5)


@pytest.mark.parametrize("value", [b"\1", b"\0"])
def test_safe_torque_off_keeps_a_group_from_being_enabled(value: bytes) -> None:
    cell = parse_cell(TEXT)
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    bench.drives[1].server.values[0x2001, 0] = value
    bench.run(600)
    bench.commands = [GroupCommand(op="enable", ref=1, group="kingkong")]
    bench.run(60)
    error = bench.replies.pop(1)
    if value == b"\0":
        assert error is None
        return
    assert isinstance(error, ErrorBody)
    assert error.code is ErrorCode.WRONG_STATE
    assert error.message == "kingkong cannot be enabled: safe torque off of kingkong.2 is active"
    said = [event.message for event in bench.events if event.kind.value == "drive_warning"]
    assert said == ["kingkong.2: safe torque off is active"]


def test_health_is_read_drive_by_drive_and_never_two_at_once() -> None:
    cell = parse_cell(TEXT)
    bench = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    for drive in bench.drives:
        drive.server.values[0x2003, 0] = (412).to_bytes(2, "little")
    busiest = 0
    for _ in range(600):
        bench.run(1)
        busy = [sum(d.channel.busy for d in bench.core.drives[bus : bus + 6]) for bus in (0, 6)]
        busiest = max(busiest, *busy)
    assert busiest == 1
    assert {round(d.health.temperature.value or 0.0, 3) for d in bench.core.drives if d.health.temperature} == {41.2}
