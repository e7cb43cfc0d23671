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
    """Two tables and a sentence; degrees and seconds."""
    ends = tuple(a + b for a, b in zip(start, target, strict=True)) if relative else target
    return Group(_axes(reply, start, ends, pulse), _segments(reply), _summary(reply))


def _axes(
    reply: MoveReply, start: tuple[float, ...], ends: tuple[float, ...], pulse: Literal["constant", "parabolic"]
) -> Table:
    table = Table(caption="degrees and seconds; v, a, j: the largest on the way", caption_justify="left")
    table.add_column("axis")
    for name in ("from", "to", "alone", "v", "a", "j"):
        table.add_column(name, justify="right")
    for row, name in enumerate(reply.scalars):
        peak = peaks(reply.T[row], reply.U[row], pulse)
        values = [f"{math.degrees(value):.2f}" for value in (start[row], ends[row])]
        values += [f"{reply.minimum_s[row]:.3f}", *(f"{math.degrees(value):.2f}" for value in peak)]
        table.add_row(name, *values, style="bold" if name == reply.limiting else None)
    return table


def _segments(reply: MoveReply) -> Table:
    table = Table(caption="segment times, seconds", caption_justify="left")
    table.add_column("axis")
    for number in range(1, 8):
        table.add_column(f"T{number}", justify="right")
    for name, times in zip(reply.scalars, reply.T, strict=True):
        table.add_row(name, *(f"{time:.3f}" for time in times), style="bold" if name == reply.limiting else None)
    return table


def _summary(reply: MoveReply) -> Text:
    limited = f", limited by {reply.limiting}" if reply.limiting else ": nothing moves"
    lines = [f"{reply.group} would take {reply.duration_s:.3f} s{limited}"]
    text = "\n".join([*lines, *(f"warning: {warning}" for warning in reply.warnings)])
    return Text(text, no_wrap=True, overflow="ignore")
