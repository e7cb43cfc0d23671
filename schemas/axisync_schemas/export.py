"""`python -m axisync_schemas.export`: writes the JSON Schema of every model a client can meet into `json/`."""

import json
from pathlib import Path
from typing import Any

from axisync_schemas.base import Strict
from axisync_schemas.cell import Cell
from axisync_schemas.commands import (
    DriveRequest,
    GroupRequest,
    JogRequest,
    LeaseRequest,
    MoveRequest,
    OverrideRequest,
    StopRequest,
)
from axisync_schemas.errors import ErrorBody
from axisync_schemas.log_models import LogLine, PlanLog, RequestLog
from axisync_schemas.replies import (
    CycleReport,
    DriveReply,
    Event,
    Events,
    GroupReply,
    Info,
    JogReply,
    LeaseReply,
    MoveReply,
    MoveReport,
    State,
)  # fmt: skip

DIRECTORY = Path(__file__).parent / "json"
MODELS: tuple[type[Strict], ...] = (
    Cell, LeaseRequest, GroupRequest, OverrideRequest, StopRequest, MoveRequest, JogRequest, DriveRequest, ErrorBody,
    LeaseReply, GroupReply, MoveReply, JogReply, DriveReply, MoveReport, State, Info, CycleReport, Event, Events,
    RequestLog, PlanLog, LogLine,
)  # fmt: skip


def schema(model: type[Strict]) -> dict[str, Any]:
    """JSON Schema of a model as it is sent."""
    return model.model_json_schema(by_alias=True, mode="validation")


def text(model: type[Strict]) -> str:
    """The committed file's text."""
    return json.dumps(schema(model), indent=2, sort_keys=True) + "\n"


def main() -> None:
    """Writes all files and removes those of models that are gone."""
    DIRECTORY.mkdir(exist_ok=True)
    names = {f"{model.__name__}.json" for model in MODELS}
    for path in DIRECTORY.glob("*.json"):
        if path.name not in names:
            path.unlink()
    for model in MODELS:
        (DIRECTORY / f"{model.__name__}.json").write_text(text(model), encoding="utf-8")


if __name__ == "__main__":
    main()
