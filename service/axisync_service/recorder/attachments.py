"""Files that travel with a log: the cell file, the robot descriptions it names, versions."""

from dataclasses import dataclass

from axisync_schemas.cell import Cell
from axisync_schemas.log_channels import robot_descriptions
from axisync_service.recorder.versions import versions_json


@dataclass(frozen=True, slots=True)
class Attached:
    """One file."""

    name: str
    media_type: str
    data: bytes


def attachments(cell: Cell, cell_text: str) -> tuple[Attached, ...]:
    """All of a cell, each name once."""
    files = [
        Attached("cell.toml", "application/toml", cell_text.encode()),
        Attached("versions.json", "application/json", versions_json()),
        *(Attached(name, "application/xml", text.encode()) for name, text in robot_descriptions(cell).items()),
    ]
    return tuple({one.name: one for one in files}.values())
