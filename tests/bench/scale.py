"""What one step of the cycle costs for 6 to 48 axes, with ideal drives and without buses: a table and a picture."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter_ns

import numpy as np
from percentiles import Distribution
from report import Report

from axisync_schemas.cell import parse_cell
from axisync_schemas.internal import BeginCommand, GroupCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import TickLayout
from axisync_service.motion_controller.demand import Inputs
from axisync_service.motion_controller.reporter import TickWriter
from axisync_service.motion_controller.step import Core
from support.ideal_drive import Bench
from support.plans import joint_plan
from support.scaled import scaled

AXES = (6, 12, 24, 48)
AXES_PER_BUS = 6
TICKS = 400
REACH = 0.5
SLOWED_AT = 250


@dataclass
class Costs:
    """us a tick."""

    moving: list[float]
    slowing: list[float]
    record: list[float]


class TimedCore(Core):
    """Knows how long each of its steps took, us."""

    spent_us = 0.0

    def step(self, inputs: Inputs, commands: list) -> None:  # type: ignore[type-arg]
        begin = perf_counter_ns()
        super().step(inputs, commands)
        self.spent_us = (perf_counter_ns() - begin) / 1e3


def measure(report: Report, figure: Path | None = None) -> None:
    """Prints the table; draws `figure` where matplotlib is there."""
    report.say(f"deciding {TICKS} ticks of a move of {', '.join(map(str, AXES))} axes")
    costs = [step_costs(axes) for axes in AXES]
    rows: dict[str, Distribution] = {}
    for axes, cost in zip(AXES, costs, strict=True):
        buses = axes // AXES_PER_BUS
        rows[f"{axes} axes, {buses} {'bus' if buses == 1 else 'buses'}: moving"] = Distribution.of(cost.moving)
        rows[f"{axes} axes: while the rate changes"] = Distribution.of(cost.slowing)
        rows[f"{axes} axes: the tick's record"] = Distribution.of(cost.record)
    report.distributions("scale", "Deciding one tick", "us", rows, (50, 99))
    if figure is not None:
        draw(figure, costs)


def step_costs(axes: int) -> Costs:
    """One move of all of them, overridden in the middle."""
    cell = parse_cell(scaled(axes // AXES_PER_BUS, AXES_PER_BUS))
    plans = bytearray(PLAN_SLOT_BYTES)
    core = TimedCore(cell, lambda slot, plan_id: PlanReader(plans, slot, plan_id))
    bench = Bench(cell, core)
    bench.run(2)
    bench.commands = [GroupCommand(op="enable", ref=1, group="all")]
    bench.run(60)
    group, members = ("all_arms", len(cell.groups)) if axes > AXES_PER_BUS else ("arm0", 1)
    start = core.current.position.tolist()
    write_plan(plans, 0, joint_plan(cell, group, start, [q + REACH / (1 + 0.05 * i) for i, q in enumerate(start)]))
    begin = BeginCommand(ref=2, group=group, plan_id=1, slot=0, epochs=(1,) * members, stop_counts=(0,) * members)
    bench.commands = [begin]
    bench.run(5)
    layout = TickLayout(len(cell.axes), len(cell.groups))
    writer = TickWriter(TickRing(bytearray(16 * (layout.size + 64)), layout, 16))
    costs = Costs([], [], [])
    for tick in range(TICKS):
        if tick == SLOWED_AT:
            bench.commands = [GroupCommand(op="hold", ref=3, group=group)]
        bench.run()
        before = perf_counter_ns()
        writer.write(tick, 0, 0, False, core.current, core)
        costs.record.append((perf_counter_ns() - before) / 1e3)
        if core.groups[0].state.label == "moving":
            costs.moving.append(core.spent_us)
        elif core.groups[0].state.label == "stopping":
            costs.slowing.append(core.spent_us)
    return costs


def draw(path: Path, costs: Sequence[Costs]) -> None:
    """Medians over the number of axes."""
    with contextlib.suppress(ImportError):
        import matplotlib as mpl

        mpl.use("svg")
        mpl.rcParams["svg.hashsalt"] = "axisync"
        from matplotlib import pyplot as plt

        plot, at = plt.subplots(figsize=(6, 3.5))
        for label, pick in (("moving", "moving"), ("while the rate changes", "slowing"), ("record", "record")):
            medians = [float(np.median(getattr(cost, pick))) for cost in costs]
            at.plot(AXES, medians, marker="o", label=label)
        at.set(xlabel="axes", ylabel="us a tick (median)", xticks=AXES, ylim=(0, None))
        at.legend()
        at.grid(alpha=0.3)
        plot.savefig(path, format="svg", metadata={"Date": None}, bbox_inches="tight")
        plt.close(plot)
