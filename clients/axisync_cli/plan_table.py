"""What `axisync plan` shows: where each axis goes, in what segments, and how hard it works."""

import math
from typing import Literal, NamedTuple

from rich.console import Group
from rich.table import Table
from rich.text import Text

from axisync_schemas.cell import Cell
from axisync_schemas.replies import MoveReply, State

MEAN_OF_PEAK = {"constant": 1.0, "parabolic": 2.0 / 3.0}
"""Mean of a jerk pulse over its peak."""

_COLUMNS = (
    ("from", "deg"), ("to", "deg"), ("alone", "s"), ("velocity", "deg/s"), ("accel.", "deg/s²"), ("jerk", "deg/s³"),
)  # fmt: skip
_CAPTION = "alone: the shortest time of this axis by itself; * sets the time of all"

NO_TIME_S = 1e-12
"""Segments as short as this are rounding."""


class Peaks(NamedTuple):
    """Largest magnitudes: rad/s, rad/s^2, rad/s^3."""

    velocity: float
    acceleration: float
    jerk: float


def peaks(times: tuple[float, ...], jerks: tuple[float, ...], pulse: Literal["constant", "parabolic"]) -> Peaks:
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


def setpoints(state: State, cell: Cell, group: str) -> tuple[float, ...]:
    """Of a group or compound, in the order of its axes."""
    names = [cell.group_names[index] for index in cell.members(group)]
    return tuple(value for name in names for value in state.groups[name].setpoint)


def plan_table(
    reply: MoveReply,
    start: tuple[float, ...],
    target: tuple[float, ...],
    relative: bool,
    pulse: Literal["constant", "parabolic"],
) -> Group:
    """Two tables, the largest values and the segments of each axis, and a sentence; degrees and seconds."""
    ends = tuple(a + b for a, b in zip(start, target, strict=True)) if relative else target
    return Group(_axes(reply, start, ends, pulse), _segments(reply), _summary(reply))


def _axes(
    reply: MoveReply, start: tuple[float, ...], ends: tuple[float, ...], pulse: Literal["constant", "parabolic"]
) -> Table:
    table = Table(caption=_CAPTION if reply.limiting else None, caption_justify="left")
    table.add_column("axis\n")
    for name, unit in _COLUMNS:
        table.add_column(f"{name}\n{unit}", justify="right")
    for row in range(len(reply.scalars)):
        peak = peaks(reply.T[row], reply.U[row], pulse)
        angles = [number(math.degrees(value)) for value in (start[row], ends[row], *peak)]
        angles.insert(2, f"{reply.minimum_s[row]:.3f}")
        table.add_row(_label(reply, row), *angles, style=_style(reply, row))
    return table


def _segments(reply: MoveReply) -> Table:
    table = Table(caption="T: s, U: deg/s³, of segments 1 to 7", caption_justify="left")
    table.add_column("axis", no_wrap=True)
    table.add_column("")
    for segment in range(1, 8):
        table.add_column(str(segment), justify="right", no_wrap=True)
    for row in range(len(reply.scalars)):
        times = [f"{time:.3f}" if time > NO_TIME_S else "0" for time in reply.T[row]]
        table.add_row(_label(reply, row), "T", *times, style=_style(reply, row))
        jerks = [_jerk(math.degrees(jerk)) for jerk in reply.U[row]]
        table.add_row("", "U", *jerks, style=_style(reply, row))
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


def _label(reply: MoveReply, row: int) -> str:
    return f"{reply.scalars[row]}{' *' if reply.scalars[row] == reply.limiting else ''}"


def _style(reply: MoveReply, row: int) -> str | None:
    return "bold" if reply.scalars[row] == reply.limiting else None


def _summary(reply: MoveReply) -> Text:
    limited = f", limited by {reply.limiting}" if reply.limiting else ": nothing moves"
    lines = [f"{reply.group} would take {reply.duration_s:.3f} s{limited}"]
    text = "\n".join([*lines, *(f"warning: {warning}" for warning in reply.warnings)])
    return Text(text, no_wrap=True, overflow="ignore")
