"""Values as people type them: `-90,60,-45,0,0,0deg`, `50%`, `8s`, `move.svg`. Pure; errors are ValueErrors in words."""

import math
import re
from enum import StrEnum
from pathlib import Path

ANGLES = {"deg": math.pi / 180.0, "rad": 1.0}
DURATIONS = {"s": 1.0, "ms": 1e-3}
PICTURES = (".svg", ".png")


class Minimise(StrEnum):
    """Choices of --minimise, as in `JointMove.minimise`."""

    ACCELERATION = "acceleration"
    VELOCITY = "velocity"
    JERK = "jerk"


class Pulse(StrEnum):
    """Choices of --pulse, as in `JointMove.pulse`."""

    CONSTANT = "constant"
    PARABOLIC = "parabolic"


_QUANTITY = re.compile(r"^(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s].*)?$")


def joint_target(text: str) -> tuple[float, ...]:
    """Radians of a comma-separated list.

    A unit on the last value alone holds for all, a unit on each value for that value; without any they are radians.

    Raises:
        ValueError: says which value is wrong and how to write it.
    """
    values = [_split(part, ANGLES) for part in text.split(",")]
    units = [unit for _, unit in values]
    if all(unit is None for unit in units[:-1]):
        units = [units[-1] or "rad"] * len(units)
    if None in units:
        raise ValueError(
            f"{text!r}: some values have a unit and some have none; write one unit at the end for all (0,90,0deg) "
            "or one at each (0rad,90deg,0rad)"
        )
    return tuple(_scaled(number, ANGLES[unit or "rad"]) for (number, _), unit in zip(values, units, strict=True))


def speed_scale(text: str) -> float:
    """`50%` or `0.5`: above 0, at most 1."""
    share = text.strip()
    number, _ = _split(share.removesuffix("%"), {})
    value = number / 100.0 if share.endswith("%") else number
    if not 0.0 < value <= 1.0:
        raise ValueError(f"{text!r}: must be above 0 and at most 1 (100%)")
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


def _scaled(number: float, factor: float) -> float:
    value = number * factor
    if not math.isfinite(value):
        raise ValueError(f"{number!r} is too large")
    return value
