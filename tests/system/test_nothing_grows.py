"""Many ticks in lock-step: nothing grows, the grid does not drift, garbage is collected at rest alone."""

import gc
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.internal import BeginCommand, GroupCommand, OverrideCommand
from axisync_schemas.log_models import PlanLog
from axisync_service.motion_controller import cycle as cycle_module
from axisync_service.motion_controller.cycle import Cycle
from support import logcheck
from support.cells import eod_text, small
from support.lock_step import Run, Script, Steps, conduct, emulated
from support.rate_runs import log_of, plan_of

UP_TICKS = 170
"""Bring-up of two drives."""
SETTLING = 600
"""Ticks before anything is compared."""
BLOCKS_PER_TICK = 0.5
"""The events of the commands below are kept by the test; a quarter of a block a tick. One object a tick is more."""


@dataclass
class Watch:
    """How many blocks of memory Python has, every hundred ticks; in which states garbage was collected."""

    blocks: list[int] = field(default_factory=list)
    states: set[GroupState] = field(default_factory=set)
    cycle: Cycle | None = None

    def each_tick(self, cycle: Cycle, tick: int) -> None:
        self.cycle = cycle
        if tick >= SETTLING and tick % 100 == 0:
            self.blocks.append(sys.getallocatedblocks())

    def collect(self, generation: int = 2) -> int:
        assert self.cycle is not None
        self.states |= {group.state for group in self.cycle.core.groups}
        return gc.collect(generation)


def steps(plan: PlanLog, ticks: int) -> Steps:
    """One move, slowed, held and resumed all the time."""
    for _ in range(UP_TICKS):
        yield None
    yield GroupCommand(op="enable", ref=0, group="both")
    yield BeginCommand(ref=0, group="both", plan_id=plan.plan_id, slot=0, epochs=())
    for tick in range(ticks):
        if tick % 100 == 0:
            yield OverrideCommand(ref=0, group="both", value=(0.1, 0.3)[tick // 100 % 2])
        if tick % 500 in (100, 300):
            yield GroupCommand(op="hold" if tick % 500 == 100 else "resume", ref=0, group="both")
        yield None
    yield OverrideCommand(ref=0, group="both", value=1.0)
    yield GroupCommand(op="disable", ref=0, group="both")


def run(directory: Path, ticks: int, watch: Watch) -> tuple[Cell, PlanLog, Run]:
    cell_file = directory / "cell.toml"
    cell_file.write_text(small(eod_text(), axes=1), encoding="utf-8")
    cell = parse_cell(cell_file.read_text(encoding="utf-8")).on_simcan(str(directory))
    plan = plan_of(cell, "both", 2.2)
    with emulated(cell_file, directory):
        return cell, plan, conduct(cell, Script(steps(plan, ticks)), [plan], watch.each_tick)


@pytest.mark.parametrize("ticks", [2500, pytest.param(30_000, marks=[pytest.mark.campaign, pytest.mark.timeout(900)])])
def test_nothing_grows_and_nothing_drifts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ticks: int) -> None:
    watch = Watch()
    monkeypatch.setattr(cycle_module, "gc", watch)
    cell, plan, done = run(tmp_path, ticks, watch)
    assert done.failure is None
    growth = (watch.blocks[-1] - watch.blocks[0]) / (100 * (len(watch.blocks) - 1))
    assert growth < BLOCKS_PER_TICK
    assert logcheck.tick_problems(log_of(cell, done, plan)) == []
    assert watch.states
    assert GroupState.MOVING not in watch.states
    assert GroupState.STOPPING not in watch.states
