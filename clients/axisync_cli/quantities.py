"""Values as people type them: `-90,60,-45,0,0,0deg`, `300,0,120mm`, `50%`. Pure; errors are ValueErrors in words."""

import math
import re
from enum import StrEnum
from pathlib import Path

ANGLES = {"deg": math.pi / 180.0, "rad": 1.0}
LENGTHS = {"mm": 1e-3, "m": 1.0}
TURNING = ANGLES | {"deg/s": math.pi / 180.0, "rad/s": 1.0}
SPEEDS = LENGTHS | {"mm/s": 1e-3, "m/s": 1.0}
DURATIONS = {"s": 1.0, "ms": 1e-3}
PICTURES = (".svg", ".png")
TWO_TURNS = 4.0 * math.pi
"""Radians; an angle beyond them that has no unit was meant in degrees."""


class Minimise(StrEnum):
    """Choices of --minimise, as in `JointMove.minimise`."""

    ACCELERATION = "acceleration"
    VELOCITY = "velocity"
    JERK = "jerk"


class Pulse(StrEnum):
    """Choices of --pulse, as in `JointMove.pulse`."""

    CONSTANT = "constant"
    PARABOLIC = "parabolic"


class Frame(StrEnum):
    """Choices of --frame, as in `axisync_schemas.moves`."""

    BASE = "base"
    BODY = "body"
    TOOL = "tool"


class Orientation(StrEnum):
    """Choices of --orientation, as in `LinearMove.orientation`."""

    ROTATION_VECTOR = "rotation_vector"
    EULER_ZYZ = "euler_zyz"


_QUANTITY = re.compile(r"^(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s].*)?$")


def joint_target(text: str) -> tuple[float, ...]:
    """Radians of a comma-separated list.

    A unit on the last value alone holds for all, a unit on each value for that value; without any they are radians.

    Raises:
        ValueError: says which value is wrong and how to write it.
    """
    values = _list(text, ANGLES, "rad")
    if max(map(abs, values)) > TWO_TURNS and not any(unit in text for unit in ANGLES):
        raise ValueError(f"{text!r}: without a unit these would be radians; write {text}deg, or {text}rad if they are")
    return values


def point(text: str) -> tuple[float, ...]:
    """`300,0,120mm`: x, y, z in m; without a unit they are metres."""
    return _counted(text, _list(text, LENGTHS, "m"), "x, y and z")


def euler(text: str) -> tuple[float, ...]:
    """`0,90,0deg`: intrinsic ZYZ angles in rad."""
    return _counted(text, _list(text, ANGLES, "rad"), "three angles")


def quaternion(text: str) -> tuple[float, ...]:
    """`0,0,0,1`: x, y, z, w."""
    return _counted(text, _list(text, {}, ""), "x, y, z and w", 4)


def linear_limits(text: str) -> tuple[float, ...]:
    """`150,200,300mm`: velocity, acceleration and jerk in m/s, m/s^2, m/s^3."""
    return _counted(text, _list(text, LENGTHS, "m"), "velocity, acceleration and jerk")


def angular_limits(text: str) -> tuple[float, ...]:
    """`30,40,80deg`: velocity, acceleration and jerk in rad/s, rad/s^2, rad/s^3."""
    return _counted(text, _list(text, ANGLES, "rad"), "velocity, acceleration and jerk")


def joint_velocity(text: str) -> tuple[float, ...]:
    """`0,0,5deg,0,0,0` or `deg/s`: rad/s; beside a value with a unit zeros need none."""
    return _list(_with_zeros(text, TURNING), TURNING, "rad/s")


def tool_velocity(text: str) -> tuple[float, ...]:
    """`20,0,0mm` or `mm/s`: along x, y, z in m/s."""
    return _counted(text, _list(_with_zeros(text, SPEEDS), SPEEDS, "m/s"), "along x, y and z")


def turn_velocity(text: str) -> tuple[float, ...]:
    """`0,0,5deg` or `deg/s`: about x, y, z in rad/s."""
    return _counted(text, _list(_with_zeros(text, TURNING), TURNING, "rad/s"), "about x, y and z")


def member_and_point(text: str) -> tuple[str | None, tuple[float, ...]]:
    """`300,0,120mm`, or `kingkong=300,0,120mm` for one group of a compound."""
    name, equals, rest = text.rpartition("=")
    return (name.strip() if equals else None), point(rest)


def speed_scale(text: str) -> float:
    """`50%` or `0.5`: above 0, at most 1."""
    share = text.strip()
    number, _ = _split(share.removesuffix("%"), {})
    value = number / 100.0 if share.endswith("%") else number
    if not 0.0 < value <= 1.0:
        raise ValueError(f"{text!r}: must be above 0 and at most 1 (100%)")
    return value


def rate(text: str) -> float:
    """`30%` or `0.3`: 0 to 1."""
    share = text.strip()
    number, _ = _split(share.removesuffix("%"), {})
    value = number / 100.0 if share.endswith("%") else number
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{text!r}: must be 0 to 1 (100%)")
    return value


def duration_s(text: str) -> float:
    """`8`, `8s` or `8000ms`: seconds above 0."""
    number, unit = _split(text, DURATIONS)
    value = number * DURATIONS[unit or "s"]
    if not 0.0 < value <= 86400.0:
        raise ValueError(f"{text!r}: must be above 0 s and at most a day")
    return value


def picture(text: str) -> Path:
    """`move.svg` or `move.png`: a file to draw into."""
    path = Path(text)
    if path.suffix not in PICTURES:
        raise ValueError(f"{text!r}: must end in {' or '.join(PICTURES)}")
    return path


def _split(text: str, units: dict[str, float]) -> tuple[float, str | None]:
    match = _QUANTITY.match(text.strip())
    if match is None:
        raise ValueError(f"{text.strip()!r} is no number" + (f" with a unit ({', '.join(units)})" if units else ""))
    unit = match["unit"]
    if unit is not None and unit not in units:
        raise ValueError(f"{text.strip()!r}: the unit {unit!r} is none of {', '.join(units) or 'those allowed (none)'}")
    return float(match["number"]), unit


def _list(text: str, units: dict[str, float], default: str) -> tuple[float, ...]:
    values = [_split(part, units) for part in text.split(",")]
    names = [unit for _, unit in values]
    if all(unit is None for unit in names[:-1]):
        names = [names[-1] or default] * len(names)
    if None in names:
        raise ValueError(
            f"{text!r}: some values have a unit and some have none; write one unit at the end for all (0,90,0deg) "
            "or one at each (0rad,90deg,0rad)"
        )
    return tuple(_scaled(number, units.get(unit or "", 1.0)) for (number, _), unit in zip(values, names, strict=True))


def _with_zeros(text: str, units: dict[str, float]) -> str:
    """Zeros without a unit get that of the others, where the last value does not give its own to all."""
    values = [_split(part, units) for part in text.split(",")]
    named = {unit for _, unit in values if unit is not None}
    if values[-1][1] is not None or len(named) != 1:
        return text
    (unit,) = named
    parts = zip(text.split(","), values, strict=True)
    return ",".join(f"0{unit}" if value == (0.0, None) else part for part, value in parts)


def _counted(text: str, values: tuple[float, ...], what: str, count: int = 3) -> tuple[float, ...]:
    if len(values) != count:
        raise ValueError(f"{text!r}: must be {count} values, {what}, not {len(values)}")
    return values


def _scaled(number: float, factor: float) -> float:
    value = number * factor
    if not math.isfinite(value):
        raise ValueError(f"{number!r} is too large")
    return value
