"""A stand-in for the controller's place in shared memory: fills the ring with records whose numbers are known."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.memory import Control, Word
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import Records, TickLayout

OPERATION_ENABLED = 0x1637


@dataclass
class Feeder:
    """Writes ticks of a smooth motion: every axis swings by `amplitude` rad at a rate of its own."""

    cell: Cell
    control: Control
    ring: TickRing
    amplitude: float = 0.2
    origin_ns: int = 0

    def __post_init__(self) -> None:
        self.origin_ns = self.origin_ns or time.monotonic_ns()
        n = len(self.cell.axes)
        self._rates = 0.13 * np.arange(1, n + 1)
        self._middle = np.array([axis.drive.start for axis in self.cell.axes])
        self._scale = np.array([axis.drive.counts_per_rad for axis in self.cell.axes])
        self._record = self.ring.layout.new()

    def record(self, tick: int) -> Records:
        """The record of `tick`: the same each time."""
        return swinging(self._record, self, tick)

    def write(self, first: int, last: int) -> None:
        """Ticks first..last into the ring, and the newest tick's number after each."""
        for tick in range(first, last + 1):
            self.ring.write(tick, self.record(tick))
            self.control[Word.CONTROLLER_TICK] = tick

    def run(self, first: int, seconds: float) -> int:
        """Ticks on the grid in real time; the last one's number."""
        begin, tick = time.monotonic_ns(), first
        while tick - first < seconds / self.cell.period:
            due = begin + (tick - first) * self.cell.period_ns
            time.sleep(max(0, due - time.monotonic_ns()) * 1e-9)
            self.write(tick, tick)
            tick += 1
        return tick - 1

    def wave(self, tick: int) -> tuple[NDArray[np.float64], ...]:
        """Position and three derivatives, [n] each."""
        w, x = self._rates, self._rates * tick * self.cell.period
        a = self.amplitude
        return (
            self._middle + a * np.sin(x),
            a * w * np.cos(x),
            -a * w**2 * np.sin(x),
            -a * w**3 * np.cos(x),
        )

    def counts(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Whole counts, as floats."""
        counts: NDArray[np.float64] = np.rint(position * self._scale)
        return counts


def swinging(record: Records, feeder: Feeder, tick: int) -> Records:
    """Fills `record`."""
    position, velocity, acceleration, jerk = feeder.wave(tick)
    moving = feeder.amplitude > 0.0
    record["tick"] = tick
    record["cycle_start_ns"] = feeder.origin_ns + tick * feeder.cell.period_ns
    record["lateness_ns"] = 20_000 + (tick * 2_654_435_761) % 30_000
    record["position"] = position
    record["velocity"] = velocity
    record["acceleration"] = acceleration
    record["jerk"] = jerk
    record["target_counts"] = feeder.counts(position)
    noise = (tick * np.arange(3, 3 + position.size)) % 3 - 1 if moving else 0
    record["position_actual"] = (feeder.counts(position) + noise) / feeder._scale
    record["statusword"] = OPERATION_ENABLED
    record["plan_id"] = 1 if moving else 0
    record["path_s"] = tick * feeder.cell.period if moving else 0.0
    record["path_rate"] = 1.0 if moving else 0.0
    record["group_state"] = GroupState.MOVING if moving else GroupState.STANDSTILL
    return record


def records(layout: TickLayout, ticks: int) -> Iterator[Records]:
    """Blank records numbered from 1."""
    for tick in range(1, ticks + 1):
        record = layout.new()
        record["tick"] = tick
        yield record
