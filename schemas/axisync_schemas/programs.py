"""Program files: a sequence of steps as people write it. TOML whose keys carry units, or a request's JSON in SI.

    schema = 1
    name = "tool change"
    group = "kingkong"
    speed_scale = 0.5          # of the limits; 1.0 where it is not given

    [[steps]]
    kind = "joint"
    target_deg = [0, -150, 60, -45, -45, 45]

    [[steps]]
    kind = "linear"
    frame = "body"
    target = { position_mm = [-310, 200, 60], euler_zyz_deg = [0, 180, 0] }
    linear_limits = { velocity_m_s = 0.1, acceleration_m_s2 = 0.2, jerk_m_s3 = 0.3 }

    [[steps]]
    kind = "dwell"
    duration_s = 0.5

Steps are those of `axisync_schemas.moves`; what has a dimension is called by its name there and a unit: `_deg` or
`_rad`, `_m` or `_mm`. Limits are called as in the cell file.
"""

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from axisync_schemas.base import Name, Strict
from axisync_schemas.cell import Limits, LinearLimits
from axisync_schemas.moves import MAX_STEPS, TAGS, Move, SequenceMove, Step

SpeedScale = Annotated[float, Field(gt=0.0, le=1.0)]
Location = tuple[int | str, ...]

ANGLE: dict[str, Callable[[float], float]] = {"deg": math.radians, "rad": float}
LENGTH: dict[str, Callable[[float], float]] = {"mm": lambda x: x / 1000.0, "m": float}
DIMENSIONS = {
    "target": ANGLE,
    "euler_zyz": ANGLE,
    "angle": ANGLE,
    "phase": ANGLE,
    "position": LENGTH,
    "centre": LENGTH,
    "amplitude": LENGTH,
    "pitch": LENGTH,
}
"""What carries a unit in the file, by its name in `moves`; `target` where it is a list of joint positions."""
UNITS = {f"{name}_{unit}": (name, si) for name, units in DIMENSIONS.items() for unit, si in units.items()}
LIMITS: dict[str, type[LinearLimits | Limits]] = {"linear_limits": LinearLimits, "angular_limits": Limits}


class ProgramError(ValueError):
    """The program file is refused; the message has one line for each fault, with line or path."""


class Body(Strict):
    """What a JSON file has, as a request has it: SI."""

    group: Name
    move: Move
    speed_scale: SpeedScale = 1.0


class Program(Body):
    """A move of a group, with a name and a description for people."""

    name: str
    description: str = ""


class _File(Strict):
    """A TOML file before its steps are looked at."""

    schema_version: Literal[1] = Field(alias="schema")
    name: str = Field(min_length=1, max_length=256)
    description: str = Field(max_length=4096, default="")
    group: Name
    speed_scale: SpeedScale = 1.0
    steps: tuple[dict[str, Any], ...] = Field(min_length=1, max_length=MAX_STEPS)


def read_program(path: Path) -> Program:
    """The checked program of a .toml or .json file.

    Raises:
        ProgramError: unreadable, or refused as by `parse_program`.
    """
    if path.suffix not in (".toml", ".json"):
        raise ProgramError(f"{path}: a program is a .toml file, or a .json file with group, move and speed_scale")
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ProgramError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise ProgramError(f"{path}: cannot be read: it is not UTF-8") from None
    return parse_program(text, str(path)) if path.suffix == ".toml" else _parse_json(text, path)


def _parse_json(text: str, path: Path) -> Program:
    try:
        body = Body.model_validate_json(text)
    except ValidationError as error:
        raise ProgramError("\n".join(_lines(error, f"{path}: "))) from None
    return Program(name=path.stem, group=body.group, move=body.move, speed_scale=body.speed_scale)


def parse_program(text: str, source: str = "program") -> Program:
    """The checked program of a TOML text.

    Raises:
        ProgramError: not TOML (with line and column), or a wrong, unknown or missing key (with step and path).
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProgramError(f"{source}: {error}") from None
    try:
        file = _File.model_validate_json(json.dumps(data, default=str))
    except ValidationError as error:
        raise ProgramError("\n".join(_lines(error, f"{source}: ", data))) from None
    steps = _steps(file.steps, source)
    return Program(
        name=file.name,
        description=file.description,
        group=file.group,
        speed_scale=file.speed_scale,
        move=SequenceMove(steps=steps),
    )


_STEP: TypeAdapter[Step] = TypeAdapter(Step)


def _steps(tables: tuple[dict[str, Any], ...], source: str) -> tuple[Step, ...]:
    steps: list[Step] = []
    faults: list[str] = []
    for number, table in enumerate(tables, start=1):
        where = f"{source}: step {number} of {len(tables)}: "
        try:
            # Through JSON, so that TOML's arrays become tuples under strict types.
            steps.append(_STEP.validate_json(json.dumps(_si(table, ()))))
        except _Fault as fault:
            faults.append(f"{where}{fault}")
        except ValidationError as error:
            faults += _lines(error, where, table)
    if faults:
        raise ProgramError("\n".join(faults))
    return tuple(steps)


class _Fault(ValueError):
    """A key that is none of the file's, or a value that has no unit's form; one line with its path."""


def _si(table: Mapping[str, Any], place: Location) -> dict[str, Any]:
    """The table with the keys and units of `moves`.

    Raises:
        _Fault: a key without its unit, twice, or with something else than numbers.
    """
    result: dict[str, Any] = {}
    for key, value in table.items():
        where = (*place, key)
        name, converted = _entry(key, value, where)
        if name in result:
            raise _Fault(f"{_path(where)}: {name} is given twice")
        result[name] = converted
    return result


def _entry(key: str, value: Any, where: Location) -> tuple[str, Any]:
    """Name and value of one key in `moves`."""
    if key in UNITS:
        name, si = UNITS[key]
        return name, _scaled(value, si, where)
    if key in LIMITS:
        return key, _limits(value, LIMITS[key], where)
    if isinstance(value, dict):
        return key, _si(value, where)
    if key in DIMENSIONS:
        table = f", or {key} = {{ position_mm = ... }}" if key == "target" else ""
        raise _Fault(f"{_path(where)}: has no unit: write {_with_unit(key)}{table}")
    return key, value


def _scaled(value: Any, si: Callable[[float], float], where: Location) -> Any:
    if isinstance(value, list):
        return [_scaled(item, si, (*where, number)) for number, item in enumerate(value)]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _Fault(f"{_path(where)}: must be numbers")
    try:
        return si(float(value))
    except OverflowError:
        raise _Fault(f"{_path(where)}: is too large") from None


def _limits(value: Any, model: type[LinearLimits | Limits], where: Location) -> list[float]:
    names = [field.alias for field in model.model_fields.values()]
    if not isinstance(value, dict) or not value.keys() <= set(names):
        raise _Fault(f"{_path(where)}: must be a table of {', '.join(map(str, names))}")
    try:
        limits = model.model_validate(value)
    except ValidationError as error:
        raise _Fault("; ".join(_lines(error, f"{_path(where)}."))) from None
    return [limits.velocity, limits.acceleration, limits.jerk]


def _with_unit(name: str) -> str:
    return " or ".join(f"{name}_{unit}" for unit in DIMENSIONS[name])


def _lines(error: ValidationError, prefix: str, data: Mapping[str, Any] | None = None) -> list[str]:
    """A line for each fault, its path as the file `data` has it."""
    return [
        f"{prefix}{_path(_in_file(_loc(fault), data))}: {fault['msg'].removeprefix('Value error, ')}"
        for fault in error.errors(include_url=False)
    ]


def _loc(fault: ErrorDetails) -> Location:
    """Where the fault is; of a kind that is missing or unknown pydantic tells only where its table is."""
    if fault["type"] in ("union_tag_not_found", "union_tag_invalid"):
        return (*fault["loc"], str(fault["ctx"]["discriminator"]).strip("'"))
    return fault["loc"]


def _in_file(loc: Location, data: Any) -> Location:
    """The path of a fault with the file's keys instead of those of `moves`, and without the tags of kinds."""
    place: list[int | str] = []
    for part in loc:
        if part in TAGS and not (isinstance(data, Mapping) and part in data):
            continue
        key = _key(part, data)
        place.append(key)
        data = data.get(key) if isinstance(data, Mapping) else None
    return tuple(place)


def _key(part: int | str, data: object) -> int | str:
    """What the file calls a key of `moves`; where it is missing, what it could be called."""
    if not isinstance(part, str) or not isinstance(data, Mapping) or part in data:
        return part
    for key, (name, _) in UNITS.items():
        if name == part and key in data:
            return key
    needs_unit = part in DIMENSIONS and (part != "target" or data.get("kind") == "joint")
    return _with_unit(part) if needs_unit else part


def _path(loc: Location) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")
    return text or "the whole file"
