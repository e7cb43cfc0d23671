"""Files that travel with a log: the cell file, the robot descriptions it names, versions."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from axisync_schemas.cell import Cell
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
        *(Attached(name, "application/xml", text.encode()) for name, text in _descriptions(cell)),
    ]
    return tuple({one.name: one for one in files}.values())


def _descriptions(part: Any) -> Iterator[tuple[str, str]]:
    """Name and text of each file that any part of the cell names: whatever has both `file` and `text`."""
    if isinstance(part, tuple):
        for one in part:
            yield from _descriptions(one)
    elif isinstance(part, BaseModel):
        file, text = getattr(part, "file", None), getattr(part, "text", None)
        if isinstance(file, str) and isinstance(text, str) and text:
            yield file, text
        for name in type(part).model_fields:
            yield from _descriptions(getattr(part, name))
