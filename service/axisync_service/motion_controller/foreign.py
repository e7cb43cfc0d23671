"""Frames that none of the cell's drives sends: another master on the bus, or a node that babbles. Pure."""

from dataclasses import dataclass

from axisync_schemas.cell import Cell
from axisync_service.canopen import sync
from axisync_service.canopen.emcy import EMCY_BASE
from axisync_service.canopen.nmt import HEARTBEAT_BASE, NMT_ID
from axisync_service.canopen.sdo import REQUEST_BASE
from axisync_service.motion_controller.groups import GroupMachine

RPDO_BASES, TPDO_BASES = (0x200, 0x300, 0x400, 0x500), (0x180, 0x280, 0x380, 0x480)
"""Of the predefined connection set (CiA 301, 7.3.5)."""
BABBLE = 4
"""Frames of no known node above one a tick, summed up: one frame a millisecond is noticed after 4 ticks of 2 ms."""
QUIET_S = 1.0
"""After which the same is news again."""


@dataclass(frozen=True, slots=True)
class Notice:
    """What is wrong on a bus, the groups with a drive there, and whether it is news."""

    bus: str
    why: str
    groups: list[GroupMachine]
    news: bool


class Foreign:
    """Counts, for each bus of the cell."""

    def __init__(self, cell: Cell, groups: list[GroupMachine]) -> None:
        self._names = [bus.name for bus in cell.buses]
        self._groups = [
            [group for group in groups if any(drive.axis.drive.bus == name for drive in group.drives)]
            for name in self._names
        ]
        nodes = [[axis.drive.node_id for axis in cell.axes if axis.drive.bus == name] for name in self._names]
        ours = (NMT_ID, sync.SYNC_ID, HEARTBEAT_BASE + cell.controller_node_id)
        self._commanding = [
            {*ours, *(base + node for base in (*RPDO_BASES, REQUEST_BASE) for node in own)} for own in nodes
        ]
        self._harmless = [{base + node for base in (EMCY_BASE, *TPDO_BASES) for node in own} for own in nodes]
        self._quiet_ticks = round(QUIET_S / cell.period)
        self._command: list[int | None] = [None] * len(nodes)
        self._strange, self._level = [0] * len(nodes), [0] * len(nodes)
        self._last: list[int | None] = [None] * len(nodes)
        self._heard = False

    def hear(self, bus: int, can_id: int) -> None:
        """A frame that is none of those the drives are configured to send."""
        if can_id in self._commanding[bus]:
            self._command[bus], self._heard = can_id, True
        elif can_id not in self._harmless[bus]:
            self._strange[bus] += 1
            self._heard = True

    def notice(self, tick: int) -> list[Notice]:
        """Call once an executed tick."""
        if not self._heard:
            return []
        found = []
        for bus, name in enumerate(self._names):
            self._level[bus] = min(max(0, self._level[bus] - 1) + self._strange[bus], 2 * BABBLE)
            why = self._wrong(bus)
            if why is not None:
                last, self._last[bus] = self._last[bus], tick
                news = last is None or tick - last > self._quiet_ticks
                found.append(Notice(name, f"bus {name}: {why}", self._groups[bus], news))
            self._command[bus], self._strange[bus] = None, 0
        self._heard = any(self._level)
        return found

    def _wrong(self, bus: int) -> str | None:
        command = self._command[bus]
        if command is not None:
            return f"somebody else sends frame 0x{command:03X}, which only this controller may"
        return "a node that is none of this cell's babbles" if self._level[bus] > BABBLE else None
