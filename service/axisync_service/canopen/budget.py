"""How full a bus is (design decision 5): worst-case stuffing, the cyclic frames, the rest, and one SDO frame a tick."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from axisync_schemas.cell import Bus, Cell
from axisync_service.canopen.pdo import TPDO1_SIZE, TPDO2_SIZE
from axisync_service.canopen.sync import COUNTER_OVERFLOW

LOAD_MAX = 0.85
TPDO2_INTERVALS = tuple(n for n in range(1, COUNTER_OVERFLOW + 1) if COUNTER_OVERFLOW % n == 0)
"""Divisors of the SYNC counter's range: so the drives' turns stay apart, whenever each of them begins to count."""
TYPICAL_STUFFING = 0.4
"""Of the worst case's stuff bits, as counted on the frames of a moving arm."""
PERIOD_STEP_S = 1e-4
_SYNC_BYTES = 1
_HEARTBEAT_BYTES = 1
_SDO_BYTES = 8


@dataclass(frozen=True, slots=True)
class BusBudget:
    """Shares of a bus's bits, and times of one cycle.

    Attributes:
        cyclic_s: SYNC, RPDOs and TPDO1s of one cycle, s.
        tpdo2_interval: each drive sends TPDO2 on every n-th SYNC; None where no n keeps the bound.
        load: share of all bits, worst-case stuffing, with heartbeats and one SDO frame a tick.
        typical: share of all bits, usual stuffing, no SDO.
        worst_cycle_s: a cycle in which everything falls due at once, with request and response of one SDO, s.
        period_min_s: the shortest period, in steps of 0.1 ms, that would keep the bound; None beyond 1 s.
        drives_max: how many drives would keep the bound at the present period.
    """

    bus: str
    drives: int
    period_s: float
    cyclic_s: float
    tpdo2_interval: int | None
    load: float
    typical: float
    worst_cycle_s: float
    period_min_s: float | None
    drives_max: int

    @property
    def fits(self) -> bool:
        """Not over the largest admissible load."""
        return self.load <= LOAD_MAX


@dataclass(frozen=True, slots=True)
class _Traffic:
    """What a bus carries. Bits are counted with `stuffing` of the worst case's stuff bits."""

    drives: int
    period_s: float
    bitrate: float
    controller_heartbeat_s: float
    drive_heartbeat_s: float
    stuffing: float = 1.0

    def cyclic_bits(self) -> float:
        return self._bits(_SYNC_BYTES) + 2 * self.drives * self._bits(TPDO1_SIZE)

    def load(self, tpdo2_interval: int | None, sdo: bool = True) -> float:
        beats = self._bits(_HEARTBEAT_BYTES) * (1 / self.controller_heartbeat_s + self.drives / self.drive_heartbeat_s)
        second = self.drives * self._bits(TPDO2_SIZE) / tpdo2_interval if tpdo2_interval else 0.0
        each_cycle = self.cyclic_bits() + second + (self._bits(_SDO_BYTES) if sdo else 0.0)
        return (each_cycle / self.period_s + beats) / self.bitrate

    def worst_cycle_bits(self, tpdo2_interval: int | None) -> float:
        second = math.ceil(self.drives / tpdo2_interval) if tpdo2_interval else 0
        rest = (1 + self.drives) * self._bits(_HEARTBEAT_BYTES) + 2 * self._bits(_SDO_BYTES)
        return self.cyclic_bits() + second * self._bits(TPDO2_SIZE) + rest

    def _bits(self, data_bytes: int) -> float:
        least = frame_bits(data_bytes)
        return least + self.stuffing * (worst_case_bits(data_bytes) - least)


def frame_bits(data_bytes: int) -> int:
    """Bits of a frame with an 11-bit identifier without stuffing: overhead 44, interframe space 3, data."""
    return 47 + 8 * data_bytes


def worst_case_bits(data_bytes: int) -> int:
    """As `frame_bits`, with the most stuff bits.

    34 + 8 n bits are subject to stuffing, the first stuff bit after 5, each later one after 4 more.
    """
    return frame_bits(data_bytes) + (34 + 8 * data_bytes - 1) // 4


def budget(cell: Cell, bus: Bus) -> BusBudget:
    """The budget of one bus of the cell."""
    drives = sum(axis.drive.bus == bus.name for axis in cell.axes)
    traffic = _traffic(cell, bus, drives, cell.period)
    interval = _interval(traffic)
    typical = _traffic(cell, bus, drives, cell.period, TYPICAL_STUFFING)
    return BusBudget(
        bus=bus.name,
        drives=drives,
        period_s=cell.period,
        cyclic_s=traffic.cyclic_bits() / bus.bitrate,
        tpdo2_interval=interval,
        load=traffic.load(interval),
        typical=typical.load(interval, sdo=False),
        worst_cycle_s=traffic.worst_cycle_bits(interval) / bus.bitrate,
        period_min_s=_shortest(_traffic(cell, bus, drives, n * PERIOD_STEP_S) for n in range(1, 10_000)),
        drives_max=_most(_traffic(cell, bus, n, cell.period) for n in range(1, 128)),
    )


def tpdo2_interval(cell: Cell, bus: Bus) -> int | None:
    """The smallest n for which TPDO2 on every n-th SYNC keeps the bound; None where TPDO2 must stay off."""
    drives = sum(axis.drive.bus == bus.name for axis in cell.axes)
    return _interval(_traffic(cell, bus, drives, cell.period))


def tpdo2_start(position: int, drives: int, interval: int) -> int:
    """SYNC start value (0x1801:6) of the `position`-th of `drives` on a bus: their turns are spread evenly."""
    return 1 + position * interval // drives % interval


def _traffic(cell: Cell, bus: Bus, drives: int, period_s: float, stuffing: float = 1.0) -> _Traffic:
    return _Traffic(drives, period_s, bus.bitrate, cell.controller_heartbeat, cell.drive_heartbeat, stuffing)


def _interval(traffic: _Traffic) -> int | None:
    return next((n for n in TPDO2_INTERVALS if traffic.load(n) <= LOAD_MAX), None)


def _shortest(candidates: Iterable[_Traffic]) -> float | None:
    return next((round(t.period_s, 6) for t in candidates if t.load(None) <= LOAD_MAX), None)


def _most(candidates: Iterable[_Traffic]) -> int:
    return sum(1 for t in candidates if t.load(None) <= LOAD_MAX)
