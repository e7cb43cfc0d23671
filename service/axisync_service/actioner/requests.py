"""From bytes to a request, or a refusal that names the field."""

from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import from_json

from axisync_schemas import SCHEMA_VERSION
from axisync_schemas.cell import Cell
from axisync_schemas.commands import (
    DriveRequest,
    GroupRequest,
    JogRequest,
    LeaseRequest,
    MoveRequest,
    OverrideRequest,
    Request,
    StopRequest,
)
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.moves import NO_KIND, TAGS

MODELS: dict[str, type[Request]] = {
    "move": MoveRequest,
    "plan": MoveRequest,
    "jog": JogRequest,
    "stop": StopRequest,
    "enable": GroupRequest,
    "disable": GroupRequest,
    "reset": GroupRequest,
    "home": GroupRequest,
    "hold": GroupRequest,
    "resume": GroupRequest,
    "override": OverrideRequest,
    "drive": DriveRequest,
    "lease": LeaseRequest,
}
"""The verbs served, and the model of each one's request."""

MAX_ERRORS = 8
"""Faults named in one refusal."""
MAX_MEMBERS = 64
"""Members of one JSON object: no request has more, and a flood of unknown ones would cost time."""
MAX_TEXT = 120

R = TypeVar("R", bound=Request)


class Unreadable(Refusal):
    """A refusal of a request that could not be read; knows its `request_id` where that much was legible."""

    def __init__(self, code: ErrorCode, message: str, request_id: str | None = None, **details: Any) -> None:
        super().__init__(code, message, **details)
        self.request_id = request_id


def parse(verb: str, body: bytes) -> Request:
    """The request that `body` holds.

    Raises:
        Unreadable: no verb, no JSON object, another schema version, or fields missing, unknown or wrong.
    """
    model = MODELS.get(verb)
    if model is None:
        raise Unreadable(ErrorCode.INVALID_REQUEST, f"{verb!r} is no verb", served=sorted(MODELS))
    return parse_as(model, body)


def parse_as(model: type[R], body: bytes) -> R:
    """As `parse`, for a known model."""
    request_id = _check_envelope(body)
    try:
        return model.model_validate_json(body)
    except ValidationError as error:
        faults = [_fault(e) for e in error.errors(include_url=False, include_context=False)[:MAX_ERRORS]]
        message = "; ".join(f"{f['path'] or 'body'}: {f['message']}" for f in faults[:3])
        raise Unreadable(ErrorCode.INVALID_REQUEST, message, request_id, errors=faults) from None


def _check_envelope(body: bytes) -> str | None:
    """The request_id, where the body is a JSON object of a version served here."""
    try:
        data = from_json(body, cache_strings="keys")
    except ValueError as error:
        raise _no_object(_short(str(error))) from None
    if not isinstance(data, dict):
        raise _no_object(f"a JSON object is expected, not {_kind(data)}")
    given = data.get("request_id")
    request_id = given if isinstance(given, str) and len(given) <= MAX_TEXT else None
    version = data.get("schema", SCHEMA_VERSION)
    if isinstance(version, int | float | str) and version != SCHEMA_VERSION:
        raise Unreadable(
            ErrorCode.UNSUPPORTED_SCHEMA, f"schema {_short(version)} is not served", request_id,
            served=[SCHEMA_VERSION], requested=_short(version),
        )  # fmt: skip
    for path, value in (("", data), *data.items()):
        if isinstance(value, dict) and len(value) > MAX_MEMBERS:
            fault = {"path": _short(path), "message": f"more than {MAX_MEMBERS} members", "value": len(value)}
            raise Unreadable(ErrorCode.INVALID_REQUEST, f"{_short(path) or 'body'}: too many members", request_id,
                             errors=[fault])  # fmt: skip
    return request_id


def _no_object(message: str) -> Unreadable:
    return Unreadable(ErrorCode.INVALID_REQUEST, message, errors=[{"path": "", "message": message}])


def _fault(error: Any) -> dict[str, Any]:
    path = _path(error["loc"])
    if error["type"] == NO_KIND and isinstance(error["input"], dict):
        return {"path": f"{path}.kind", "message": error["msg"], "value": _short(error["input"].get("kind"))}
    return {"path": path, "message": error["msg"], "value": _short(error["input"])}


def _path(loc: tuple[int | str, ...]) -> str:
    keys = [part for part in loc if part not in TAGS]
    return "".join(f"[{p}]" if isinstance(p, int) else f".{_short(p)}" for p in keys).lstrip(".")


def _short(value: object) -> str:
    """A value as text of bounded length; of a container, only what it is."""
    if isinstance(value, dict | list | tuple):
        return f"{_kind(value)} of {len(value)}"
    text = value if isinstance(value, str) else repr(value)
    text = text.encode("utf-8", "replace").decode()
    return text if len(text) <= MAX_TEXT else f"{text[:MAX_TEXT]}..."


def _kind(value: object) -> str:
    names = {dict: "an object", list: "an array", tuple: "an array", str: "a string", bool: "a boolean"}
    return names.get(type(value), "null" if value is None else "a number")


def members_of(cell: Cell, name: str, path: str = "group") -> tuple[int, ...]:
    """Indices of the elementary groups that a request names.

    Raises:
        Refusal: no such group.
    """
    try:
        return cell.members(name)
    except KeyError:
        known = [*cell.group_names, *(compound.name for compound in cell.compounds), "all"]
        message = f"{path}: no group {name!r} in this cell"
        fault = {"path": path, "message": message, "value": name}
        raise Refusal(ErrorCode.INVALID_REQUEST, message, errors=[fault], groups=known) from None
