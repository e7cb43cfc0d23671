"""A session as the service should log it, computed instead of played: for testing the checkers, and as an example."""

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_motion import PathClock, Trajectory, from_profiles, synchronise
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import Records, TickLayout, shorten_rates
from support.logread import JsonMessage, Log
from support.plans import tables_of

WALL_NS = 1_700_000_000_000_000_000
MONOTONIC_NS = 5_000_000_000
REST_TICKS = 20


def plan(cell: Cell, group: str, distance: float = 1.0) -> tuple[Trajectory, tuple[int, ...]]:
    """A move of a group's axes by distances from `distance` down, by turns forth and back, and those axes."""
    axes = cell.axis_indices(group)
    limits = [cell.axes[axis].limits for axis in axes]
    start = np.array([cell.axes[axis].drive.start for axis in axes])
    target = start + distance * np.array([(-1) ** n / (1 + 0.3 * n) for n in range(len(axes))])
    profile = synchronise(
        target - start, [x.velocity for x in limits], [x.acceleration for x in limits], [x.jerk for x in limits]
    )
    return from_profiles(start, profile, target), axes


@dataclass
class Session:
    """Rest, one move of `group`, rest. `stop_tick`: ticks after the move's begin at which it is stopped."""

    cell: Cell
    group: str = "kingkong"
    stop_tick: int | None = None
    distance: float = 1.0
    records: list[Records] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.layout = TickLayout(len(self.cell.axes), len(self.cell.groups))
        self.trajectory, self.axes = plan(self.cell, self.group, self.distance)
        self._position = np.array([axis.drive.start for axis in self.cell.axes])
        self._scale = np.array([axis.drive.counts_per_rad for axis in self.cell.axes])
        for _ in range(REST_TICKS):
            self._tick(GroupState.STANDSTILL)
        self._move()
        for _ in range(REST_TICKS - 1):
            self._tick(GroupState.STANDSTILL)

    def _move(self) -> None:
        axes = list(self.axes)
        clock = PathClock(self.trajectory, tables_of(self.cell, axes, self.trajectory), self.cell.period)
        ticks = 0
        while True:
            if ticks == self.stop_tick:
                clock.stop()
            clock.advance()
            ticks += 1
            q, v, a, j = clock.motion()
            self._position[axes] = q
            if clock.at_rest:
                self._tick(GroupState.STANDSTILL, (v, a, np.zeros_like(j)))
                return
            state = GroupState.STOPPING if clock.stopping else GroupState.MOVING
            self._tick(state, (v, a, j), clock.s, clock.rate)

    def _tick(
        self,
        state: GroupState,
        rates: tuple[NDArray[np.float64], ...] | None = None,
        path_s: float = 0.0,
        path_rate: float = 0.0,
    ) -> None:
        record = self.layout.new()
        tick = len(self.records) + 1
        members = list(self.cell.members(self.group))
        record["tick"] = tick
        record["cycle_start_ns"] = MONOTONIC_NS + tick * self.cell.period_ns
        record["position"] = self._position
        record["target_counts"] = np.rint(self._position * self._scale)
        record["group_state"] = GroupState.STANDSTILL
        record["group_state"][members] = state
        for name, values in zip(("velocity", "acceleration", "jerk"), rates or (), strict=rates is not None):
            record[name][list(self.axes)] = values
        shorten_rates(record)
        if state is not GroupState.STANDSTILL:
            record["plan_id"][members] = 1
            record["path_s"][members] = path_s
            record["path_rate"][members] = path_rate
        self.records.append(record)

    def log(self) -> Log:
        """As read from files."""
        ticks = np.array(self.records, dtype=self.layout.dtype)
        status = "succeeded" if self.stop_tick is None else "stopped"
        ended = MONOTONIC_NS + len(ticks) * self.cell.period_ns
        event = {
            "kind": "move_ended",
            "source": "controller",
            "now_s": ended / 1e9,
            "details": {"plan_id": 1, "status": status},
        }
        offset = WALL_NS - MONOTONIC_NS
        return Log(
            cell=self.cell,
            layout=self.layout,
            ticks=ticks,
            log_times_ns=ticks["cycle_start_ns"] + np.uint64(offset),
            duplicates=0,
            events=[JsonMessage(ended + offset, event)],
            requests=[],
            plans={1: self._plan()},
            metadata={"axisync.clocks": {"offset_ns": str(offset), "wall_ns": str(WALL_NS)}},
            attachments={},
            complete=True,
        )

    def _plan(self) -> dict[str, Any]:
        return {
            "plan_id": 1,
            "group": self.group,
            "axes": list(self.axes),
            "knots": self.trajectory.knots.tolist(),
            "coefficients": self.trajectory.coefficients.tolist(),
            "start": self.trajectory.start.tolist(),
            "end": self.trajectory.end.tolist(),
        }


def candump(log: Log, path: Path) -> None:
    """The frames that a controller would have sent for a log: SYNC of tick k, then the RPDOs for k + 1."""
    ticks, lines = log.ticks, []
    for row, record in enumerate(ticks):
        if record["skipped"]:
            continue
        at = float(log.log_times_ns[row]) / 1e9
        for bus in log.cell.buses:
            counter = (int(record["tick"]) - 1) % 240 + 1
            lines.append(f"({at:.6f}) {bus.name} 080#{counter:02X}")
            if row + 1 == len(ticks):
                continue
            for axis, one in enumerate(log.cell.axes):
                if one.drive.bus == bus.name:
                    data = struct.pack("<Hi", 0x1F, int(ticks[row + 1]["target_counts"][axis]))
                    lines.append(f"({at + 1e-4:.6f}) {bus.name} {0x200 + one.drive.node_id:03X}#{data.hex().upper()}")
    path.write_text("\n".join(lines) + "\n")
