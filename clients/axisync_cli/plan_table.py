"""What `axisync plan` shows: where everything goes, in what segments, how hard it works, and what room is left."""

import math
from typing import NamedTuple

from rich.console import Group
from rich.table import Table

from axisync_cli.plan_curves import PulseName, sampled
from axisync_cli.scalars import Scalar, units
from axisync_schemas.replies import MoveReply

MEAN_OF_PEAK = {"constant": 1.0, "parabolic": 2.0 / 3.0}
"""Mean of a jerk pulse over its peak."""

_AXES = (
    ("from", "deg"), ("to", "deg"), ("alone", "s"), ("velocity", "deg/s"), ("accel.", "deg/s²"), ("jerk", "deg/s³"),
)  # fmt: skip
_PATH = (("distance", ""), ("alone", "s"), ("velocity", "/s"), ("accel.", "/s²"), ("jerk", "/s³"))
_CAPTION = "alone: the shortest time of this one by itself; * sets the time of all"

NO_TIME_S = 1e-12
"""Segments as short as this are rounding."""


class Peaks(NamedTuple):
    """Largest magnitudes: rad/s, rad/s^2, rad/s^3."""

    velocity: float
    acceleration: float
    jerk: float


def peaks(times: tuple[float, ...], jerks: tuple[float, ...], pulse: PulseName) -> Peaks:
    """Of one axis, from segment times (s) and the peak jerk of each: at segment ends, where a symmetric curve peaks."""
    velocity = acceleration = 0.0
    velocities, accelerations = [0.0], [0.0]
    for duration, jerk in zip(times, jerks, strict=True):
        change = MEAN_OF_PEAK[pulse] * jerk * duration
        velocity += (acceleration + 0.5 * change) * duration
        acceleration += change
        velocities.append(abs(velocity))
        accelerations.append(abs(acceleration))
    return Peaks(max(velocities), max(accelerations), max(abs(jerk) for jerk in jerks))


def plan_table(reply: MoveReply, scalars: tuple[Scalar, ...], pulse: PulseName) -> Group:
    """The largest values and the segments of each row, or the steps. Degrees, millimetres, seconds."""
    if reply.steps:
        return Group(_steps(reply))
    return Group(_largest(reply, scalars, pulse), _segments(reply, scalars))


def _largest(reply: MoveReply, scalars: tuple[Scalar, ...], pulse: PulseName) -> Table:
    axes = all(scalar.axis for scalar in scalars)
    marked = reply.limiting in reply.scalars
    table = Table(caption=_CAPTION if marked else None, caption_justify="left")
    table.add_column("axis\n" if axes else "path\n")
    for name, unit in _AXES if axes else _PATH:
        table.add_column(f"{name}\n{unit}", justify="right")
    for row, scalar in enumerate(scalars):
        peak = peaks(reply.T[row], reply.U[row], pulse)
        travelled = float(sampled(reply.T[row], reply.U[row], pulse)[1][0, -1])
        ends = (scalar.start, scalar.start + travelled) if axes else (travelled,)
        cells = [*(number(scalar.shown(value)) for value in ends), f"{reply.minimum_s[row]:.3f}"]
        cells += [number(scalar.shown(value)) for value in peak]
        table.add_row(_label(reply, scalar), *cells, style=_style(reply, scalar))
    return table


def _segments(reply: MoveReply, scalars: tuple[Scalar, ...]) -> Table:
    jerk_units = " and ".join(f"{unit}/s³" for unit in units(scalars))
    table = Table(caption=f"T: s, U: {jerk_units}, of segments 1 to 7", caption_justify="left")
    table.add_column("axis" if all(scalar.axis for scalar in scalars) else "path", no_wrap=True)
    table.add_column("")
    for segment in range(1, 8):
        table.add_column(str(segment), justify="right", no_wrap=True)
    for row, scalar in enumerate(scalars):
        times = [f"{time:.3f}" if time > NO_TIME_S else "0" for time in reply.T[row]]
        table.add_row(_label(reply, scalar), "T", *times, style=_style(reply, scalar))
        jerks = [_jerk(scalar.shown(jerk)) for jerk in reply.U[row]]
        table.add_row("", "U", *jerks, style=_style(reply, scalar))
    return table


def _steps(reply: MoveReply) -> Table:
    table = Table()
    for name in ("step", "kind"):
        table.add_column(name)
    for name in ("begins, s", "takes, s", "stretched"):
        table.add_column(name, justify="right")
    table.add_column("limited by")
    for number, step in enumerate(reply.steps, start=1):
        stretched = f"{step.scale:.2f}" if step.scale > 1.0 else ""
        times = (f"{step.begins_s:.3f}", f"{step.duration_s:.3f}")
        table.add_row(str(number), step.kind, *times, stretched, step.limiting or "")
    return table


def number(value: float) -> str:
    """Two decimals, or three where two would hide a slow motion; never -0.00."""
    text = f"{value:.3f}" if 0.0005 <= abs(value) < 0.095 else f"{value:.2f}"
    return "0.00" if text == "-0.00" else text


def _jerk(value: float) -> str:
    """Six characters for any jerk of a robot: the table must fit into 80 columns."""
    if value == 0.0:
        return "0"
    return number(value) if abs(value) < 99.995 else f"{value:.0f}"


def _label(reply: MoveReply, scalar: Scalar) -> str:
    return f"{scalar.label}{' *' if scalar.name == reply.limiting else ''}"


def _style(reply: MoveReply, scalar: Scalar) -> str | None:
    return "bold" if scalar.name == reply.limiting else None


def summary(reply: MoveReply, scalars: tuple[Scalar, ...]) -> str:
    """Sentences, a line each: duration and what sets it, where it ends, and what room is left."""
    lines = [f"{reply.group} would take {reply.duration_s:.3f} s{_limited(reply)}"]
    if reply.scale > 1.0:
        whose = f"{reply.limiting} would exceed its limits" if reply.limiting else "joints would exceed their limits"
        most = " at most" if reply.steps else ""
        lines.append(f"stretched {reply.scale:.3g} times{most}, or {whose}")
    if reply.end and not (scalars and all(scalar.axis for scalar in scalars)):
        lines.append(f"ends with the joints at {','.join(number(math.degrees(value)) for value in reply.end)}deg")
    lines += _room(reply)
    lines += [f"warning: {warning}" for warning in reply.warnings]
    return "\n".join(lines)


def _limited(reply: MoveReply) -> str:
    if reply.steps:
        return f" in {len(reply.steps)} steps"
    return f", limited by {reply.limiting}" if reply.limiting else ": nothing moves"


def _room(reply: MoveReply) -> list[str]:
    """How near it comes to anything, and how near where drives have to stop by themselves."""
    lines = []
    if reply.min_distance_m is not None:
        pair = f"{' and '.join(reply.nearest)} come nearest, " if reply.nearest else "shapes come nearest, "
        lines.append(f"{pair}{1e3 * reply.min_distance_m:.1f} mm apart")
    if reply.alone is not None:
        near = reply.alone.min_distance_m
        apart = "" if near is None else f" and {1e3 * near:.1f} mm between shapes"
        margin = f"{math.degrees(reply.alone.limit_margin):.1f} deg to the hard limit of {reply.alone.axis}"
        lines.append(f"drives that stop by themselves would leave {margin}{apart}")
    return lines
