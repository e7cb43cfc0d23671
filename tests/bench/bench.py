"""One run: the service under a client's moves, a reference loop beside it, and what log and shared memory say of it."""

import os
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import arms
import clients
import dashboard
import drives
import numpy as np
import planner
import recorder
import review
import scale
import soak
import stops_ratio
from crowd import Crowd
from daemon import Daemon
from lines import tool_lines
from percentiles import Distribution
from phases import SWING_DEG, Arms, Call, acquire
from processes import Sampler, Usage, find
from reference import Reference, Scheduling, bare_cycle
from report import Report
from stages import StageReader
from stress import Stress
from ticklog import TickLog, read

from axisync_client import Client
from axisync_schemas.cell import Cell
from axisync_schemas.ticks import Records
from axisync_service.canopen.budget import budget
from axisync_service.motion_controller.clock import GridClock, MonotonicTime
from support.cells import eod_text

BENCHES = (
    "planner", "arms", "drives", "ratio", "scale", "recorder", "review", "lateness", "stages", "clients", "requests",
    "stops", "processes", "flood", "subscribers", "dashboard", "browser",
    "soak",
)  # fmt: skip
SERVICE_FREE = frozenset({"planner", "arms", "drives", "ratio", "scale", "recorder", "review"})
"""Benches of libraries alone, or in lock-step."""
UNASKED = frozenset(BENCHES) - {"soak"}
"""What runs unless something is named; a soak is as long as `--seconds`, and wants many."""
SWINGING = frozenset({"lateness", "stages", "processes", "soak"})
"""Benches that need the arms to move for a while."""
PAGES = frozenset({"dashboard", "browser"})
"""Benches that need the dashboard."""
GROUP = "both"
ALONE_S = 10.0
FLOODING, WATCHING, WATCHING_TURNS = 4, (0, 1, 10, 50), 4
"""Clients that ask for plans; clients that subscribe to every tick, in turns."""
RATIO_MOVES, RATIO_LINES = 150, 100
"""Of each four stops: 1,000 in all."""


@dataclass(slots=True)
class Findings:
    """What was measured while the service ran."""

    cell: Cell
    scheduling: Scheduling
    span_ns: tuple[int, int] = (0, 0)
    beside: tuple[str, Distribution] | None = None
    stages: dict[str, Distribution] = field(default_factory=dict)
    usages: list[Usage] = field(default_factory=list)
    requests: list[Call] = field(default_factory=list)
    stops: list[Call] = field(default_factory=list)
    flooded: list[Call] = field(default_factory=list)
    watched_ns: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    pages: dashboard.Seen | None = None
    growth: soak.Growth | None = None
    failures: list[str] = field(default_factory=list)


class Bench:
    """The benches that are wanted, in one run of the service."""

    def __init__(
        self, report: Report, wanted: frozenset[str], seconds: float, moves: int, figure: Path | None = None,
        stress: str | None = None,
    ) -> None:  # fmt: skip
        """`figure`: where the picture of `scale` goes. `stress`: what is done to the machine beside the service."""
        self._figure, self._stress = figure, stress
        self._report = report
        self._wanted = wanted
        self._seconds = seconds
        self._moves = moves

    def run(self, directory: Path) -> None:
        """Measures and prints.

        Raises:
            DaemonError, AxisyncError, RuntimeError, LookupError, ValueError: it cannot, and why.
        """
        if "planner" in self._wanted:
            planner.measure(self._report)
        if "arms" in self._wanted:
            arms.measure(self._report)
        if "drives" in self._wanted:
            drives.measure(self._report)
        if "recorder" in self._wanted:
            recorder.measure(self._report, self._seconds)
        if "review" in self._wanted:
            with tempfile.TemporaryDirectory(prefix="axisync-bench-") as scratch:
                review.measure(self._report, Path(scratch))
        if "ratio" in self._wanted:
            stops_ratio.measure(self._report, RATIO_MOVES, tool_lines(RATIO_LINES))
        if "scale" in self._wanted:
            scale.measure(self._report, self._figure)
        if self._wanted <= SERVICE_FREE:
            return
        cell = soak.cell(eod_text()) if "soak" in self._wanted else None
        with Daemon(directory, cell) as daemon, Stress(self._stress):
            self._report.say("starting the service")
            daemon.wait_ready()
            found = self._measure(daemon)
            daemon.stop()
            log = read(daemon.logs())
        if "lateness" in self._wanted:
            self._lateness(found, log)
        self._cycle(found)
        self._calls(found, log)
        if "processes" in self._wanted:
            self._report.processes("CPU and memory of each process, while both arms move", found.usages)
        self._failures(found)

    def _measure(self, daemon: Daemon) -> Findings:
        controller = find(daemon.pid, "controller").pid
        with Client(daemon.endpoint) as client, acquire(client, GROUP) as lease:
            found = Findings(client.config(), Scheduling.of(controller))
            lease.enable(GROUP)
            arms = Arms(client, lease, GROUP)
            if self._wanted & SWINGING:
                self._report.say(f"moving {len(found.cell.axes)} axes for {self._seconds:g} s")
                self._swing(daemon, controller, arms, found)
            if "clients" in self._wanted:
                clients.measure(self._report, client, arms, self._moves)
            if "requests" in self._wanted:
                self._report.say(f"starting {self._moves} short moves")
                found.requests = arms.requests(self._moves)
            if "stops" in self._wanted:
                self._report.say(f"stopping {self._moves} moves")
                found.stops = arms.stops(self._moves)
            if "flood" in self._wanted:
                self._report.say(f"stopping {self._moves} moves while {FLOODING} clients ask for plans")
                with Crowd("plan", daemon.endpoint, FLOODING):
                    found.flooded = arms.stops(self._moves)
            if "subscribers" in self._wanted:
                self._subscribers(daemon, arms, found)
            if self._wanted & PAGES:
                seconds = self._seconds if "dashboard" in self._wanted else 0.0
                presses = self._moves if "browser" in self._wanted else 0
                page = daemon.directory / "page"
                found.pages = dashboard.measure(self._report, page, daemon.endpoint, arms, seconds, presses)
            found.failures = arms.failures
            lease.disable(GROUP)
        return found

    def _subscribers(self, daemon: Daemon, arms: Arms, found: Findings) -> None:
        """In turns, since this machine is not equally fast at all times."""
        for turn in range(WATCHING_TURNS):
            self._report.say(f"moving with {', '.join(map(str, WATCHING))} subscribers of every tick, turn {turn + 1}")
            for count in WATCHING:
                with Crowd("watch", daemon.endpoint, count):
                    span = arms.swing(self._seconds / len(WATCHING) / WATCHING_TURNS, lambda: None)
                found.watched_ns.setdefault(count, []).append(span)

    def _swing(self, daemon: Daemon, controller: int, arms: Arms, found: Findings) -> None:
        stages = StageReader(controller, len(found.cell.groups))
        beside = Reference(found.cell.period, self._seconds, found.scheduling.beside())
        try:
            sampler = Sampler(daemon.pid, ("bench (client)", os.getpid()))
            growth = soak.Growth(sampler.usage, self._seconds)

            def look() -> None:
                stages.poll()
                growth.poll()

            degrees = soak.SWING_DEG if "soak" in self._wanted else SWING_DEG
            found.span_ns = arms.swing(self._seconds, look, degrees)
            found.growth = growth
            found.usages = sampler.usage()
            found.beside = (beside.name, beside.result())
        finally:
            beside.stop()
        found.stages = stages.distributions()
        if "stages" in self._wanted:
            buses = len(found.cell.buses)
            found.stages["frames alone, without a service"] = bare_cycle(
                found.cell.period, min(ALONE_S, self._seconds), found.scheduling.beside(),
                buses, -(-len(found.cell.axes) // buses),
            )  # fmt: skip

    def _lateness(self, found: Findings, log: TickLog) -> None:
        assert found.beside is not None
        seconds = min(ALONE_S, self._seconds)
        self._report.say(f"the reference alone, for {seconds:g} s")
        alone = Reference(found.cell.period, seconds, found.scheduling).result()
        name, beside = found.beside
        ticks = log.between(*found.span_ns)
        rows = {
            "controller": lateness(ticks),
            f"{name} beside it": beside,
            f"{name} alone": alone,
        }

        def lost(latest_us: float | None) -> dict[str, int]:
            periods = {row: times.periods_lost(found.cell.period * 1e6, latest_us) for row, times in rows.items()}
            return periods | {"controller": int(ticks["skipped"].sum())}

        latest_us = _latest_us(found.cell)
        columns = {"periods lost": lost(None), f"skipped from {latest_us:.0f} us late": lost(latest_us)}
        title = (
            f"Lateness of {found.cell.period * 1e3:g} ms ticks, {len(found.cell.axes)} axes moving, "
            f"{found.scheduling.words()}"
        )
        self._report.distributions("lateness", title, "us", rows, (50, 99, 99.9), columns)

    def _cycle(self, found: Findings) -> None:
        if "stages" in self._wanted:
            title = f"Time in the cycle by stage, of {found.cell.period * 1e6:,.0f} us"
            self._report.distributions("stages", title, "us", found.stages, (50, 99))

    def _failures(self, found: Findings) -> None:
        """They belong to the result: a loop in time is worth nothing if drives give up beside it."""
        self._report.data["failures"] = found.failures
        for reason, count in Counter(found.failures).items():
            self._report.say(f"failed {count} times: {reason}")

    def _calls(self, found: Findings, log: TickLog) -> None:
        if found.requests:
            rows = _spans(found.requests, log.first_setpoint_ns, "first setpoint in force")
            self._report.distributions("requests", "From a call of `move` (12 axes) to", "ms", rows, (50, 99))
        if found.stops:
            rows = _spans(found.stops, log.first_slowed_ns, "first slowed setpoint in force")
            self._report.distributions("stops", "From a call of `stop` to", "ms", rows, (50, 99))
        if found.flooded:
            rows = _spans(found.flooded, log.first_slowed_ns, "first slowed setpoint in force")
            title = f"From a call of `stop`, while {FLOODING} clients ask for plans, to"
            self._report.distributions("flood", title, "ms", rows, (50, 99))
        if found.watched_ns:
            spans = {
                f"{n} subscribers": lateness(*(log.between(*turn) for turn in turns))
                for n, turns in found.watched_ns.items()
            }
            self._report.distributions("subscribers", "Lateness beside subscribers", "us", spans, (50, 99, 99.9))
        if found.pages is not None:
            self._pages(found.pages, found, log)
        if "soak" in self._wanted and found.growth is not None:
            found.growth.say(self._report, log.between(*found.span_ns), found.cell.period_ns)

    def _pages(self, pages: dashboard.Seen, found: Findings, log: TickLog) -> None:
        if pages.spans_ns:
            dashboard.say(self._report, len(found.cell.axes), pages)
            spans = {f"{n} viewers": lateness(log.between(*span)) for n, span in pages.spans_ns.items()}
            self._report.distributions("pages", "Lateness beside viewers of the dashboard", "us", spans, (50, 99, 99.9))
        if pages.presses:
            rows = _spans(pages.presses, log.first_slowed_ns, "first slowed setpoint in force")
            del rows["answer"]
            self._report.distributions("presses", "From a browser's space bar to", "ms", rows, (50, 99))


def _latest_us(cell: Cell) -> float:
    """Up to when after its begin the controller still uses a tick: its frames must be out before the next one."""
    worst_wire_s = max(budget(cell, bus).cyclic_s for bus in cell.buses)
    return GridClock(MonotonicTime(), cell.period_ns, round(worst_wire_s * 1e9)).latest_ns / 1e3


def _spans(calls: list[Call], instant_ns: Callable[[str], int], what: str) -> dict[str, Distribution]:
    """Milliseconds from the call to its effect (t of that tick) and to its answer."""
    effects = [(instant_ns(call.move_id) - call.called_ns) / 1e6 for call in calls]
    answers = [(call.answered_ns - call.called_ns) / 1e6 for call in calls]
    return {what: Distribution.of(effects), "answer": Distribution.of(answers)}


def lateness(*spans: Records) -> Distribution:
    """Microseconds, of all ticks of some spans."""
    return Distribution.of([late for ticks in spans for late in _late_us(ticks)])


def _late_us(ticks: Records) -> list[float]:
    """A skipped tick counts as late as until the next one that was executed, so it cannot hide."""
    if not ticks["skipped"].size or ticks["skipped"].all():
        return []
    late = ticks["lateness_ns"].astype(np.float64)
    begins = ticks["cycle_start_ns"].astype(np.int64)
    executed = np.flatnonzero(ticks["skipped"] == 0)
    following = executed[np.minimum(np.searchsorted(executed, np.arange(len(ticks))), len(executed) - 1)]
    waited = np.maximum(begins[following] - begins, 0)
    us: list[float] = ((waited + late[following]) / 1e3).tolist()
    return us
