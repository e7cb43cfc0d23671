"""hold, resume, override: decisions of the cycle about the rate of moves, judged tick by tick."""

import math

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.events import EventKind
from axisync_schemas.internal import BeginCommand, GroupCommand, OverrideCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_service.motion_controller.step import Core
from support.cells import eod_text
from support.ideal_drive import Bench
from support.plans import joint_plan

TEXT = eod_text()
P2 = [math.radians(x) for x in (100, -90, -60, -120, 45, 45)]
PERIOD = 0.002
LIMITS, STOP_LIMITS = np.radians([30.0, 40.0, 80.0]), np.radians([30.0, 60.0, 240.0])


@pytest.fixture
def bench() -> Bench:
    """KingKong, enabled, half a second into P1 -> P2."""
    cell = parse_cell(TEXT)
    plans = bytearray(PLAN_SLOT_BYTES)
    made = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(plans, slot, plan_id)))
    made.run(2)
    made.commands = [GroupCommand(op="enable", ref=1, group="all")]
    made.run(60)
    start = [made.core.current.position[i] for i in range(6)]
    write_plan(plans, 0, joint_plan(cell, "kingkong", start, P2, plan_id=2))
    made.commands = [BeginCommand(ref=2, group="kingkong", plan_id=2, slot=0, epochs=(1,), stop_counts=(0,))]
    made.run(251)
    made.rows.clear()
    return made


def command(bench: Bench, op: str, ref: int = 9) -> object:
    bench.commands = [GroupCommand.model_validate({"op": op, "ref": ref, "group": "kingkong"})]
    bench.run()
    return bench.replies.pop(ref)


def override(bench: Bench, value: float) -> None:
    bench.commands = [OverrideCommand(ref=8, group="kingkong", value=value)]
    bench.run()
    assert bench.replies.pop(8) is None


def state(bench: Bench) -> GroupState:
    return bench.core.groups[0].state


def check(bench: Bench, limits: np.ndarray) -> None:
    """Velocity, acceleration and jerk of all ticks so far, as said and by differences of positions."""
    rows = [np.array([row[k] for row in bench.rows])[:, :6] for k in range(4)]
    for values, bound in zip(rows[1:], limits, strict=True):
        assert np.abs(values).max() <= bound * (1 + 1e-6)
    for power, bound in enumerate(limits, start=1):
        differences = np.diff(rows[0], n=power, axis=0) / PERIOD**power
        assert np.abs(differences).max() <= bound * (1 + 1e-6) + 1e-14 / PERIOD**power


def run_until(bench: Bench, wanted: GroupState, most: int = 8000) -> int:
    for tick in range(most):
        if state(bench) is wanted:
            return tick
        bench.run()
    raise AssertionError(f"{state(bench)!r} after {most} ticks")


def test_hold_rests_on_the_path_and_resume_goes_on_to_the_target(bench: Bench) -> None:
    assert command(bench, "hold") is None
    assert state(bench) is GroupState.STOPPING
    run_until(bench, GroupState.HELD)
    bench.run(2)
    held = bench.core.current.position[:6].copy()
    bench.run(50)
    assert (bench.core.current.position[:6] == held).all()
    assert command(bench, "resume") is None
    assert state(bench) is GroupState.MOVING
    run_until(bench, GroupState.STANDSTILL)
    bench.run(2)
    assert bench.core.current.position[:6].tolist() == P2
    check(bench, STOP_LIMITS)
    kinds = [event.kind for event in bench.events]
    assert kinds.index(EventKind.MOVE_RESUMED) < kinds.index(EventKind.MOVE_ENDED)


def test_resume_while_still_slowing(bench: Bench) -> None:
    command(bench, "hold")
    bench.run(40)
    assert state(bench) is GroupState.STOPPING
    assert command(bench, "resume") is None
    run_until(bench, GroupState.STANDSTILL)
    bench.run(2)
    assert bench.core.current.position[:6].tolist() == P2
    check(bench, STOP_LIMITS)


@pytest.mark.parametrize("value", [0.3, 0.05])
def test_override_slows_within_the_limits_of_moves(bench: Bench, value: float) -> None:
    override(bench, value)
    bench.run(1500)
    motion = bench.core.groups[0].motion
    assert motion is not None
    assert motion.rate == value
    override(bench, 1.0)
    run_until(bench, GroupState.STANDSTILL)
    bench.run(2)
    assert bench.core.current.position[:6].tolist() == P2
    check(bench, LIMITS)


def test_an_override_of_nothing_and_back(bench: Bench) -> None:
    override(bench, 0.0)
    bench.run(1500)
    assert state(bench) is GroupState.MOVING
    rest = bench.core.current.position[:6].copy()
    bench.run(20)
    assert (bench.core.current.position[:6] == rest).all()
    override(bench, 1.0)
    run_until(bench, GroupState.STANDSTILL)
    check(bench, LIMITS)


def test_an_override_changed_all_the_time(bench: Bench) -> None:
    rng = np.random.default_rng(3)
    for _ in range(300):
        override(bench, float(rng.uniform(0.0, 1.0)))
    override(bench, 1.0)
    run_until(bench, GroupState.STANDSTILL)
    check(bench, LIMITS)


def test_an_override_is_kept_for_the_next_hold_and_resume(bench: Bench) -> None:
    override(bench, 0.5)
    command(bench, "hold")
    run_until(bench, GroupState.HELD)
    command(bench, "resume")
    bench.run(1000)
    motion = bench.core.groups[0].motion
    assert motion is not None
    assert motion.rate == 0.5


def test_a_stop_during_a_hold_and_after_it(bench: Bench) -> None:
    command(bench, "hold")
    bench.run(20)
    bench.stops[0] += 1
    run_until(bench, GroupState.STANDSTILL)
    refused = command(bench, "resume")
    assert isinstance(refused, ErrorBody)
    assert refused.code is ErrorCode.WRONG_STATE
    check(bench, STOP_LIMITS)


def test_a_stop_while_resuming(bench: Bench) -> None:
    command(bench, "hold")
    run_until(bench, GroupState.HELD)
    command(bench, "resume")
    bench.run(60)
    bench.stops[0] += 1
    bench.run()
    run_until(bench, GroupState.STANDSTILL)
    check(bench, STOP_LIMITS)


def test_only_what_moves_is_held_and_only_what_is_held_is_resumed(bench: Bench) -> None:
    for op, group, text in (("resume", "kingkong", "nothing is held"), ("hold", "wukong", "no move to hold")):
        bench.commands = [GroupCommand.model_validate({"op": op, "ref": 9, "group": group})]
        bench.run()
        refused = bench.replies.pop(9)
        assert isinstance(refused, ErrorBody)
        assert refused.code is ErrorCode.WRONG_STATE
        assert text in refused.message


def test_nobody_resumes_without_a_lease(bench: Bench) -> None:
    bench.leases[0] = 0
    run_until(bench, GroupState.HELD)
    refused = command(bench, "resume")
    assert isinstance(refused, ErrorBody)
    assert refused.code is ErrorCode.LEASE_REQUIRED
    bench.leases[0] = 2**62
    bench.run(20)
    assert state(bench) is GroupState.HELD
    assert command(bench, "resume") is None
    run_until(bench, GroupState.STANDSTILL)
