"""How full a bus is (design decision 5): worst-case stuffing, the cyclic frames, the rest, and one SDO frame a tick."""

from dataclasses import dataclass

from axisync_schemas.cell import Bus, Cell
from axisync_service.canopen.pdo import TPDO1_SIZE

LOAD_MAX = 0.85
_SYNC_BYTES = 1
_HEARTBEAT_BYTES = 1
_SDO_BYTES = 8


@dataclass(frozen=True, slots=True)
class BusBudget:
    """Shares of a bus's bits, and times of one cycle.

    Attributes:
        cyclic_s: SYNC, RPDOs and TPDOs of one cycle, s.
        load: share of all bits, with heartbeats and one SDO frame a tick.
        worst_cycle_s: a cycle in which everything falls due at once, s.
    """

    bus: str
    drives: int
    period_s: float
    cyclic_s: float
    load: float
    worst_cycle_s: float

    @property
    def fits(self) -> bool:
        """Not over the largest admissible load."""
        return self.load <= LOAD_MAX


def worst_case_bits(data_bytes: int) -> int:
    """Bits of a frame with an 11-bit identifier: overhead 44, interframe space 3, data, and the most stuff bits.

    34 + 8 n bits are subject to stuffing, the first stuff bit after 5, each later one after 4 more.
    """
    return 47 + 8 * data_bytes + (34 + 8 * data_bytes - 1) // 4


def budget(cell: Cell, bus: Bus) -> BusBudget:
    """The budget of one bus of the cell."""
    drives = sum(axis.drive.bus == bus.name for axis in cell.axes)
    cyclic = worst_case_bits(_SYNC_BYTES) + 2 * drives * worst_case_bits(TPDO1_SIZE)
    heartbeat = worst_case_bits(_HEARTBEAT_BYTES)
    sdo = worst_case_bits(_SDO_BYTES)
    beats = heartbeat * (1 / cell.controller_heartbeat + drives / cell.drive_heartbeat)
    worst = cyclic + (1 + drives) * heartbeat + 2 * sdo
    return BusBudget(
        bus=bus.name,
        drives=drives,
        period_s=cell.period,
        cyclic_s=cyclic / bus.bitrate,
        load=(cyclic / cell.period + beats + sdo / cell.period) / bus.bitrate,
        worst_cycle_s=worst / bus.bitrate,
    )
