"""What to do about a refusal, in words: from the numbers in its details, lengths in millimetres."""

import math
from collections.abc import Callable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any

UP, DOWN = Context(prec=6, rounding=ROUND_CEILING), Context(prec=6, rounding=ROUND_FLOOR)
"""Advice is rounded to the side on which it is still accepted."""


def fix_of(details: dict[str, Any]) -> str | None:
    """The fix that an error body's details carry, in words; None where they carry none."""
    fix = details.get("fix")
    if isinstance(fix, str):
        return fix
    if isinstance(fix, dict) and isinstance(group := fix.get("group"), str):
        return f"move both as one, as group {group}"
    values = fix if isinstance(fix, dict) else details
    said = (words(values.get(key)) for key, words in _WORDS.items())
    return next((text for text in said if text is not None), None)


def _groups(names: Any) -> str | None:
    return f"the groups are {', '.join(map(str, names))}" if isinstance(names, list) else None


def _speed(scale: Any) -> str | None:
    return f"the highest feasible speed_scale is {_rounded(scale, DOWN)}" if _is_number(scale) else None


def _duration(shortest: Any) -> str | None:
    return f"the shortest possible duration is {_rounded(shortest, UP)} s" if _is_number(shortest) else None


def _nearest(pose: Any) -> str | None:
    """As it can be typed, in the frame of the request."""
    if not isinstance(pose, dict) or not isinstance(pose.get("position"), list):
        return None
    position = ",".join(f"{1e3 * value:.2f}" for value in pose["position"])
    turned = pose.get("quaternion")
    oriented = f", quaternion {','.join(f'{value:.5f}' for value in turned)}" if isinstance(turned, list) else ""
    return f"the nearest reachable pose is {position}mm{oriented}"


def _wait(group: Any) -> str | None:
    return f"wait until {group} has ended its move" if isinstance(group, str) else None


_WORDS: dict[str, Callable[[Any], str | None]] = {
    "groups": _groups,
    "max_feasible_speed_scale": _speed,
    "shortest_duration_s": _duration,
    "nearest_reachable": _nearest,
    "wait_for": _wait,
}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _rounded(value: float, context: Context) -> str:
    return f"{float(context.create_decimal(repr(value))):.6g}"
