"""What the frames on the buses prove: the drives were told what the log says, at the SYNC the log says.

Reads logs in candump's format (`candump -L`): `(seconds) interface 201#1F0000000000`.
"""

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import Cell
from axisync_schemas.ticks import Records
from support.logcheck import COMMANDED, count_mismatches
from support.logread import Log

SYNC = 0x080
RPDO1 = 0x200
COUNTERS = 240
_LINE = re.compile(r"\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{3,8})#([0-9A-Fa-f]*)(?:\s+[TR])?\s*$")
_RPDO1 = struct.Struct("<Hi")


@dataclass(frozen=True, slots=True)
class Frame:
    """One line; `at` in seconds as candump stamped it."""

    at: float
    interface: str
    can_id: int
    data: bytes


@dataclass(slots=True)
class BusFrames:
    """What the drives of one bus were told.

    Attributes:
        ticks: [m] tick of each SYNC, from its counter.
        targets: [m, n] counts in force at each SYNC, by axis of the bus (the newest RPDO before it), 0 before any.
        heard: [m, n] whether there had been an RPDO.
        axes: [n] indices in `Cell.axes`.
        problems: what the frames alone show to be wrong.
    """

    axes: tuple[int, ...]
    ticks: NDArray[np.int64]
    targets: NDArray[np.int64]
    heard: NDArray[np.bool_]
    problems: list[str] = field(default_factory=list)


def parse(path: Path) -> Iterator[Frame]:
    """Every frame; a last line cut short is left out.

    Raises:
        AssertionError: another line that is none of candump's.
    """
    lines = path.read_text().split("\n")
    for number, line in enumerate(lines, 1):
        match = _LINE.match(line)
        if match is not None and len(match[4]) % 2 == 0:
            yield Frame(float(match[1]), match[2], int(match[3], 16), bytes.fromhex(match[4]))
        elif line and number < len(lines):
            raise AssertionError(f"{path}:{number}: {line!r} is no candump line")


def interfaces(cell: Cell) -> dict[str, str]:
    """Bus by what a candump line may call it: the bus's name, its channel, or its socket's name."""
    names = {}
    for bus in cell.buses:
        names.update({bus.name: bus.name, bus.channel: bus.name, Path(bus.channel).stem: bus.name})
    return names


def collect(
    cell: Cell, frames: list[Frame], buses: Mapping[str, str] | None = None, first_tick: int | None = None
) -> dict[str, BusFrames]:
    """SYNCs and targets of every bus of the cell.

    Args:
        buses: bus name by interface; default: `interfaces(cell)`.
        first_tick: tick of the first SYNC; default: its counter, right where the dump began before tick 240.
    """
    buses = interfaces(cell) if buses is None else buses
    return {
        bus.name: _of_bus(cell, bus.name, [f for f in frames if buses.get(f.interface) == bus.name], first_tick)
        for bus in cell.buses
    }


def _of_bus(cell: Cell, name: str, frames: list[Frame], first_tick: int | None) -> BusFrames:
    collector = _Collector(cell, name, first_tick)
    for frame in frames:
        if frame.can_id == SYNC:
            collector.sync(frame)
        elif frame.can_id in collector.column:
            collector.rpdo(frame)
    return collector.result()


class _Collector:
    """Goes through the frames of one bus in their order."""

    def __init__(self, cell: Cell, name: str, first_tick: int | None) -> None:
        self.axes = tuple(i for i, axis in enumerate(cell.axes) if axis.drive.bus == name)
        self.column = {RPDO1 + cell.axes[axis].drive.node_id: n for n, axis in enumerate(self.axes)}
        self._cell, self._name, self._first_tick = cell, name, first_tick
        self._targets, self._heard = np.zeros(len(self.axes), np.int64), np.zeros(len(self.axes), bool)
        self._ticks: list[int] = []
        self._rows: list[tuple[NDArray[np.int64], NDArray[np.bool_]]] = []
        self._before: Frame | None = None
        self._problems: list[str] = []

    def sync(self, frame: Frame) -> None:
        """Keeps what is in force now."""
        tick = _tick(self._cell, self._before, frame, self._ticks[-1] if self._ticks else None, self._first_tick)
        if self._ticks and tick <= self._ticks[-1]:
            self._problems.append(f"SYNC counter {frame.data.hex()} twice, after tick {self._ticks[-1]}")
            return
        self._ticks.append(tick)
        self._rows.append((self._targets.copy(), self._heard.copy()))
        self._before = frame

    def rpdo(self, frame: Frame) -> None:
        """A target that the next SYNC makes valid."""
        if len(frame.data) != _RPDO1.size:
            self._problems.append(f"RPDO {frame.can_id:#x} of {len(frame.data)} bytes")
            return
        self._targets[self.column[frame.can_id]] = _RPDO1.unpack(frame.data)[1]
        self._heard[self.column[frame.can_id]] = True

    def result(self) -> BusFrames:
        """As arrays."""
        shape = (len(self._rows), len(self.axes))
        return BusFrames(
            self.axes,
            np.array(self._ticks, np.int64),
            np.array([row[0] for row in self._rows], np.int64).reshape(shape),
            np.array([row[1] for row in self._rows], bool).reshape(shape),
            self._problems,
        )


def _tick(cell: Cell, before: Frame | None, frame: Frame, last: int | None, first_tick: int | None) -> int:
    """The counter gives the tick but for multiples of 240; time, where more than that was skipped, the rest."""
    counter = frame.data[0] if frame.data else 0
    if before is None or last is None:
        return counter if first_tick is None else first_tick
    step = (counter - before.data[0]) % COUNTERS
    elapsed = (frame.at - before.at) / cell.period
    return last + step + COUNTERS * max(0, round((elapsed - step) / COUNTERS))


def problems(log: Log, frames: Mapping[str, BusFrames]) -> list[str]:
    """All of it; an empty list is good."""
    found = []
    for name, bus in frames.items():
        texts = (*bus.problems, *sync_problems(log, bus), *target_problems(log, bus), *velocity_problems(log, bus))
        found += [f"{name}: {text}" for text in texts]
    return found


def sync_problems(log: Log, bus: BusFrames) -> list[str]:
    """There is a SYNC for each executed tick of the log, and none for a skipped one."""
    if not len(bus.ticks):
        return ["no SYNC"]
    low, high = max(bus.ticks[0], int(log.ticks["tick"][0])), min(bus.ticks[-1], int(log.ticks["tick"][-1]))
    if low > high:
        return [f"frames of ticks {bus.ticks[0]}..{bus.ticks[-1]} and a log of others"]
    executed = log.ticks["tick"][log.ticks["skipped"] == 0].astype(np.int64)
    executed = executed[(executed >= low) & (executed <= high)]
    sent = bus.ticks[(bus.ticks >= low) & (bus.ticks <= high)]
    missing, surplus = np.setdiff1d(executed, sent), np.setdiff1d(sent, executed)
    found = [f"no SYNC at tick {tick}" for tick in missing[:5]]
    return found + [f"a SYNC at tick {tick}, which the log calls skipped or lacks" for tick in surplus[:5]]


def target_problems(log: Log, bus: BusFrames) -> list[str]:
    """The targets in force at a SYNC are those of the log, to one count.

    An executed tick m sends the setpoints of tick m + 1. So at a SYNC after skipped ticks those of the first of these
    are in force: they are compared with the record of tick m + 1, m being the executed tick before.
    """
    found = []
    rows, records = _paired(log, bus)
    for n, axis in enumerate(bus.axes):
        commanded = np.isin(records["group_state"][:, _group_of(log.cell, axis)], [int(s) for s in COMMANDED])
        silent = commanded & ~bus.heard[rows, n]
        if silent.any():
            found.append(f"{log.cell.axes[axis].name} has no target at tick {records['tick'][silent][0]}")
        judged = commanded & bus.heard[rows, n]
        counts, logged = bus.targets[rows, n][judged], records["target_counts"][judged, axis].astype(np.int64)
        wrong = np.abs((counts - logged + 2**31) % 2**32 - 2**31) > 1
        found += [
            f"tick {records['tick'][judged][t]}, {log.cell.axes[axis].name}: frame has {counts[t]}, the log {logged[t]}"
            for t in np.flatnonzero(wrong)[:3]
        ]
        full = records["target_counts"][judged].copy()
        full[:, axis] = counts
        found += count_mismatches(log, full, records[judged], "frame")[:3]
    return found


def velocity_problems(log: Log, bus: BusFrames) -> list[str]:
    """Between two SYNCs a target moves no further than V allows, and a count of rounding."""
    found = []
    rows, records = _paired(log, bus)
    spans: NDArray[np.float64] = np.diff(records["tick"].astype(np.float64)) * log.cell.period
    for n, axis in enumerate(bus.axes):
        one = log.cell.axes[axis]
        commanded = np.isin(records["group_state"][:, _group_of(log.cell, axis)], [int(s) for s in COMMANDED])
        steps = np.abs((np.diff(bus.targets[rows, n]) + 2**31) % 2**32 - 2**31)
        allowed = spans * (one.limits.velocity * abs(one.drive.counts_per_rad) * (1 + 1e-9)) + 1.0
        fast = np.flatnonzero((steps > allowed) & commanded[1:] & commanded[:-1] & bus.heard[rows, n][:-1])
        found += [
            f"tick {records['tick'][1:][t]}, {one.name}: the target moves {steps[t]} counts, allowed {allowed[t]:.1f}"
            for t in fast[:3]
        ]
    return found


def _paired(log: Log, bus: BusFrames) -> tuple[NDArray[Any], Records]:
    """Rows of `bus`, and for each the record whose setpoint the log says is in force; the first has none before it."""
    ticks = log.ticks["tick"].astype(np.int64)
    in_force = bus.ticks[:-1] + 1
    known = np.flatnonzero(np.isin(in_force, ticks))
    return known + 1, log.ticks[np.searchsorted(ticks, in_force[known])]


def _group_of(cell: Cell, axis: int) -> int:
    return next(g for g, name in enumerate(cell.group_names) if axis in cell.axis_indices(name))
