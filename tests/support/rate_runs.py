"""Moves under hold, resume, override and stop in lock-step, judged by the log's positions and the drives' frames."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisync_motion import Trajectory
from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.events import EventKind
from axisync_schemas.internal import BeginCommand, GroupCommand, OverrideCommand
from axisync_schemas.log_models import PlanLog
from axisync_schemas.memory import GroupWord
from axisync_schemas.ticks import TickLayout
from axisync_service.mapper.counts import CountMap
from axisync_service.motion_controller.clock import GridClock, TimeSource
from axisync_service.motion_controller.cycle import Cycle
from support import framecheck, logcheck
from support.lock_step import Run, Script, Steps, as_log, conduct, emulated
from support.logread import JsonMessage, Log
from support.plans import joint_plan

UP_TICKS = 1000
"""Bring-up takes less."""
AFTER_TICKS = 20
MOST_TICKS = 3000
"""After the last order."""
Order = tuple[int, str | float]
"""Ticks after the move's begin, and hold, resume, stop, or an override."""
Late = dict[int, int]
"""Ticks that wake late, by how much, ns; beyond the clock's `latest_ns` they are skipped."""


@dataclass(slots=True)
class RateRun:
    """One move of `group`, and what came of it."""

    cell: Cell
    group: str
    plan: PlanLog
    run: Run
    log: Log
    frames: dict[str, framecheck.BusFrames]

    @property
    def members(self) -> list[int]:
        """Elementary groups that move."""
        return list(self.cell.members(self.group))

    @property
    def moving(self) -> NDArray[np.intp]:
        """Rows of the move."""
        return np.flatnonzero(self.log.ticks["plan_id"][:, self.members[0]] == self.plan.plan_id)

    def kinds(self) -> list[str]:
        """Of all events."""
        return [event.kind.value for event in self.run.happenings]


@dataclass(slots=True)
class Outside:
    """What the script knows of the cycle, and its stops by group."""

    stops: list[int]
    cycle: Cycle | None = None
    waited: int = 0

    def ready(self) -> bool:
        """Every drive is brought up; given up after a while."""
        if self.cycle is None:
            return False
        self.waited += 1
        return self.waited > UP_TICKS or all(group.ready for group in self.cycle.core.groups)

    def moving(self) -> bool:
        """A motion is under way, or held."""
        return self.cycle is not None and bool(self.cycle.core.motions.all())


class LateTime:
    """The bus's time, but waking up late for some ticks; lock-step's clock itself does not move meanwhile."""

    def __init__(self, source: TimeSource, clock: GridClock, late: Late) -> None:
        self._source, self._clock, self._late = source, clock, late
        self._ahead_ns = 0

    def now_ns(self) -> int:
        return self._source.now_ns() + self._ahead_ns

    def wait_until_ns(self, instant_ns: int) -> None:
        self._ahead_ns = 0
        self._source.wait_until_ns(instant_ns)
        index = round((instant_ns - self._clock.due_ns(0)) / self._clock.period_ns)
        self._ahead_ns = self._late.get(index, 0)


def play_orders(
    directory: Path, text: str, orders: Sequence[Order], group: str = "both", reach: float = 1.5,
    late: Late | None = None,
) -> RateRun:  # fmt: skip
    """Moves every axis of the group by up to `reach`, rad, and gives orders on the way."""
    cell_file = directory / "cell.toml"
    cell_file.write_text(text, encoding="utf-8")
    cell = parse_cell(text).on_simcan(str(directory))
    plan = plan_of(cell, group, reach)
    outside = Outside(stops=[0] * len(cell.groups))
    script = Script(_steps(cell, plan, group, orders, outside))

    def each_tick(cycle: Cycle, tick: int) -> None:
        if late and outside.cycle is None:
            cycle.clock.source = LateTime(cycle.clock.source, cycle.clock, late)
        outside.cycle = cycle
        for index, count in enumerate(outside.stops):
            cycle.control.set_group(index, GroupWord.STOP_COUNT, count)

    with emulated(cell_file, directory):
        run = conduct(cell, script, [plan], each_tick)
    frames = list(framecheck.parse(directory / "frames.log"))
    return RateRun(cell, group, plan, run, log_of(cell, run, plan), framecheck.collect(cell, frames))


def plan_of(cell: Cell, group: str, reach: float) -> PlanLog:
    """From where the emulated drives stand."""
    counts = CountMap(cell.axes)
    at = counts.to_position(counts.to_counts(np.array([axis.drive.start for axis in cell.axes])))
    axes = list(cell.axis_indices(group))
    low, high = np.array([cell.axes[i].soft_limits for i in axes]).T
    start = at[axes]
    way = reach / (1.0 + 0.4 * np.arange(len(axes))) * np.where(start > (low + high) / 2, -1.0, 1.0)
    return as_log(joint_plan(cell, group, start.tolist(), (start + way).tolist()), group)


def _steps(cell: Cell, plan: PlanLog, group: str, orders: Sequence[Order], outside: Outside) -> Steps:
    while not outside.ready():
        yield None
    yield GroupCommand(op="enable", ref=0, group=group)
    yield BeginCommand(ref=0, group=group, plan_id=plan.plan_id, slot=0, epochs=())
    passed = 0
    for at, order in orders:
        for _ in range(at - passed):
            yield None
        passed = at
        if order == "stop":
            outside.stops[cell.members(group)[0]] += 1
        elif order in ("hold", "resume"):
            yield GroupCommand.model_validate({"op": order, "ref": 0, "group": group})
        else:
            yield OverrideCommand(ref=0, group=group, value=float(order))
    for _ in range(MOST_TICKS):
        if not outside.moving():
            break
        yield None
    for _ in range(AFTER_TICKS):
        yield None


def log_of(cell: Cell, run: Run, plan: PlanLog) -> Log:
    """As the recorder would have it."""
    events = [
        JsonMessage(0, {"kind": happening.kind.value, "details": happening.details}) for happening in run.happenings
    ]
    times = run.records["cycle_start_ns"]
    layout = TickLayout(len(cell.axes), len(cell.groups))
    plans = {plan.plan_id: plan.model_dump(mode="json")}
    return Log(cell, layout, run.records, times, 0, events, [], plans, {}, {}, True)


# --- verdicts -------------------------------------------------------------------------------------------------------


def problems(played: RateRun) -> list[str]:
    """Everything that is wrong with it, from log and frames; an empty list is good."""
    log = played.log
    checks = (
        logcheck.tick_problems, logcheck.derivative_problems, logcheck.count_problems, logcheck.rest_problems,
        logcheck.move_problems,
    )  # fmt: skip
    found = [text for check in checks for text in check(log)]
    return found + limit_problems(played) + path_problems(played) + framecheck.problems(log, played.frames)


def limit_problems(played: RateRun) -> list[str]:
    """V, A, J by differences: `stop_limits` where a window of samples touches a stop, else `limits`."""
    cell, rows = played.cell, played.moving
    axes = list(played.plan.axes)
    before, after = min(int(rows[0]), 3), min(len(played.log.ticks) - 1 - int(rows[-1]), 3)
    positions = played.log.ticks["position"][rows[0] - before : rows[-1] + after + 1][:, axes]
    stopping = np.pad(_within_stop_limits(played), (before, after), mode="edge")
    found = []
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        values = np.abs(np.diff(positions, order, axis=0)) / cell.period**order
        touched = np.lib.stride_tricks.sliding_window_view(stopping, order + 1).any(axis=1)
        normal, stop = (np.array([getattr(getattr(cell.axes[i], of), name) for i in axes]) for of in
                        ("limits", "limits" if name == "velocity" else "stop_limits"))  # fmt: skip
        rounding = 2.0**order * 4 * np.finfo(float).eps * np.maximum(np.abs(positions).max(axis=0), 1.0)
        allowed = np.where(touched[:, np.newaxis], stop, normal) * (1 + 1e-6) + rounding / cell.period**order
        share = values / allowed
        if share.max() > 1.0:
            tick, axis = np.unravel_index(share.argmax(), share.shape)
            where = f"row {rows[0] - before + tick}, {cell.axes[axes[axis]].name}"
            found.append(f"{where}: {name} is {share.max():.9f} of what is allowed")
    return found


def _within_stop_limits(played: RateRun) -> NDArray[np.bool_]:
    """Rows of the move at which the stop limits apply: while it stops, and after a resume until the rate is caught."""
    ticks, member = played.log.ticks[played.moving], played.members[0]
    rate = ticks["path_rate"][:, member]
    stopping: NDArray[np.bool_] = ticks["group_state"][:, member] == GroupState.STOPPING
    falls = np.diff(rate, prepend=1.0) < 0.0
    wide = stopping.copy()
    for row in np.flatnonzero(stopping[:-1] & ~stopping[1:]) + 1:
        while row < len(wide) and falls[row]:
            wide[row] = True
            row += 1
        if row < len(wide):
            wide[row] = True  # the tick in which it is caught
    return wide


def path_problems(played: RateRun) -> list[str]:
    """No axis leaves the planned path by a count; the path is never run backwards, nor faster than planned."""
    plan, rows, member = played.plan, played.moving, played.members[0]
    path = Trajectory(*(np.array(x) for x in (plan.knots, plan.coefficients, plan.start, plan.end)))
    ticks = played.log.ticks[rows]
    s, rate = ticks["path_s"][:, member], ticks["path_rate"][:, member]
    away = np.abs(ticks["position"][:, list(plan.axes)] - path.sample(s)[0]).max(axis=0)
    count = 1.0 / np.abs([played.cell.axes[i].drive.counts_per_rad for i in plan.axes])
    found = [
        f"axis {i} leaves the path by {a / c:.2g} counts"
        for i, (a, c) in enumerate(zip(away, count, strict=True))
        if a > c
    ]
    steps = np.diff(s)
    if (steps < 0.0).any() or (steps > played.cell.period * (1.0 + 1e-9)).any():
        found.append("path_s does not run from its begin to its end")
    if rate.min() < 0.0 or rate.max() > 1.0 + 1e-9:
        found.append(f"path_rate is from {rate.min()} to {rate.max()}")
    means = (rate[1:] + rate[:-1]) / 2.0 * played.cell.period
    bends = np.abs(np.diff(rate, 2, prepend=rate[0], append=rate[-1]))  # the rate is no straight line within a tick
    bent = np.maximum(bends[1:], bends[:-1]) / 6.0 * played.cell.period
    if (np.abs(steps - means) > 2e-6 + 1e-3 * means + bent).any() and s[-1] < plan.knots[-1]:
        found.append("path_rate is not what path_s runs at")
    return found


def rate_of(played: RateRun) -> NDArray[np.float64]:
    """[ticks of the move] of the path clock."""
    rate: NDArray[np.float64] = played.log.ticks["path_rate"][played.moving][:, played.members[0]]
    return rate


def stopped_s(played: RateRun) -> float:
    """From the first tick of STOPPING to rest."""
    states = played.log.ticks["group_state"][:, played.members[0]]
    return float(np.count_nonzero(states == GroupState.STOPPING) * played.cell.period)


def never_relaxed(played: RateRun) -> bool:
    """No event says that an override broke the limits of moves."""
    return EventKind.RATE_RELAXED.value not in played.kinds()
