"""Which frame goes to which drive: one table a bus, made once."""

from collections.abc import Callable

from axisync_schemas.cell import Cell
from axisync_service.canopen.emcy import EMCY_BASE
from axisync_service.canopen.nmt import HEARTBEAT_BASE
from axisync_service.canopen.pdo import TPDO1_BASE, TPDO2_BASE
from axisync_service.canopen.sdo import RESPONSE_BASE
from axisync_service.drives.link import DriveLink

Handler = Callable[[bytes, int], None]
"""Takes a frame's data and the time at which it was read, ns."""


def dispatch_tables(cell: Cell, drives: list[DriveLink]) -> list[dict[int, Handler]]:
    """For each bus: identifier to handler."""
    return [
        {
            can_id: handler
            for drive in drives
            if drive.axis.drive.bus == bus.name
            for can_id, handler in _handlers(drive).items()
        }
        for bus in cell.buses
    ]


def _handlers(drive: DriveLink) -> dict[int, Handler]:
    node = drive.axis.drive.node_id
    return {
        TPDO1_BASE + node: lambda data, _: drive.on_tpdo1(data),
        TPDO2_BASE + node: lambda data, _: drive.on_tpdo2(data),
        EMCY_BASE + node: lambda data, _: drive.on_emergency(data),
        HEARTBEAT_BASE + node: drive.on_heartbeat,
        RESPONSE_BASE + node: lambda data, _: drive.bring_up.sdo.receive(data),
    }
