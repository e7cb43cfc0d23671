"""Reads what is not process data: one object of one drive of a bus at a time, round after round, by SDO."""

from axisync_schemas.cell import Cell
from axisync_schemas.events import EventKind
from axisync_service.canopen.sdo import SdoError
from axisync_service.drives.bring_up import Phase
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.voice import Severity, Voice

INTERVAL_S = 0.04
"""Between two objects of one bus: 3 objects of 6 drives take 0.7 s."""
_AT_REST = (Phase.READY, Phase.FAILED, Phase.PRESENCE)


class Rounds:
    """One visitor a bus. Drives that are absent do not hold it up; one that is being brought up does."""

    def __init__(self, cell: Cell, groups: list[GroupMachine], voice: Voice) -> None:
        self._voice = voice
        self._ticks = max(len(cell.buses), round(INTERVAL_S / cell.period))
        self._buses = [
            [(group, drive) for group in groups for drive in group.drives if drive.axis.drive.bus == bus.name]
            for bus in cell.buses
        ]
        self._turn = [0] * len(self._buses)

    def visit(self, tick: int) -> None:
        """Asks for the next object of the bus whose turn it is in this tick, if any."""
        bus = tick % self._ticks
        if bus >= len(self._buses):
            return
        drives = self._buses[bus]
        if not drives or any(drive.bring_up.phase not in _AT_REST for _, drive in drives):
            return
        self._turn[bus] = (self._turn[bus] + 1) % len(drives)
        group, drive = drives[self._turn[bus]]
        if drive.bring_up.ready and not drive.channel.busy:
            self._ask(group, drive)

    def _ask(self, group: GroupMachine, drive: DriveLink) -> None:
        item = drive.health.next()
        if item is None:
            return

        def say(text: str, warning: bool) -> None:
            name = drive.axis.name
            severity: Severity = "warning" if warning else "info"
            self._voice.say(EventKind.DRIVE_WARNING, f"{name}: {text}", group.name, severity, axis=name)

        def take(answer: bytes | SdoError) -> None:
            drive.health.take(item, answer, say)

        drive.channel.read(*item.key, take)
