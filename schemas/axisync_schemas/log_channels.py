"""Topics of a log, and of its live view: what other people's tools need to read them without this package."""

import copy
import json
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel

from axisync_schemas import joint_states, ticks_pb2
from axisync_schemas.cell import Cell
from axisync_schemas.log_models import LogLine, PlanLog, RequestLog
from axisync_schemas.replies import Event
from axisync_schemas.ticks import file_descriptor_set
from axisync_schemas.topics import (
    LOG_EVENTS,
    LOG_JOINT_STATES,
    LOG_LINES,
    LOG_PLANS,
    LOG_REQUESTS,
    LOG_SETPOINTS,
)  # fmt: skip

JSON_TOPICS: dict[str, tuple[str, type[BaseModel]]] = {
    LOG_REQUESTS: ("axisync.RequestLog", RequestLog),
    LOG_PLANS: ("axisync.PlanLog", PlanLog),
    LOG_EVENTS: ("axisync.Event", Event),
    LOG_LINES: ("foxglove.Log", LogLine),
}
"""Schema's name and model of each."""


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic as a log declares it; `schema` is in the words of `schema_encoding`."""

    topic: str
    encoding: str
    name: str
    schema_encoding: str
    schema: bytes


@cache
def channels() -> tuple[Channel, ...]:
    """All of them."""
    tick = ticks_pb2.SetpointTick.DESCRIPTOR.full_name
    return (
        Channel(LOG_SETPOINTS, "protobuf", tick, "protobuf", file_descriptor_set()),
        Channel(LOG_JOINT_STATES, "protobuf", joint_states.SCHEMA, "protobuf", joint_states.schema()),
        *(
            Channel(topic, "json", name, "jsonschema", json.dumps(json_schema(name, model)).encode())
            for topic, (name, model) in JSON_TOPICS.items()
        ),
    )


def labels(cell: Cell) -> dict[str, str]:
    """The metadata of `/setpoints`: what its columns are."""
    return {
        "axes": " ".join(axis.name for axis in cell.axes),
        "groups": " ".join(cell.group_names),
        "period_ns": str(cell.period_ns),
    }


def robot_descriptions(cell: Cell) -> dict[str, str]:
    """Text of each URDF file that the cell names, by the file's name."""
    return {group.urdf.file: group.urdf.text for group in cell.groups if group.urdf is not None}


def json_schema(title: str, model: type[BaseModel]) -> dict[str, Any]:
    """The model's JSON Schema with every reference resolved: viewers that know no `$ref` can read it."""
    whole = model.model_json_schema(mode="serialization")
    definitions = whole.pop("$defs", {})
    resolved: dict[str, Any] = _resolved(whole, definitions)
    return {**resolved, "title": title}


def _resolved(part: Any, definitions: dict[str, Any]) -> Any:
    if isinstance(part, list):
        return [_resolved(one, definitions) for one in part]
    if not isinstance(part, dict):
        return part
    if "$ref" in part:
        target = copy.deepcopy(definitions[part["$ref"].rpartition("/")[2]])
        return _resolved({**target, **{key: value for key, value in part.items() if key != "$ref"}}, definitions)
    return {key: _resolved(value, definitions) for key, value in part.items()}
