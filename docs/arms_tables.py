"""The tables of arms.md: what the log shows by differences of its positions, and durations beside TOPP-RA's."""

import numpy as np
from arms_log import CHANGE, CHANGE_PARABOLIC, LINE, LINE_PARABOLIC, POINTS, TO_P2, Array, Recorded, recorded
from retimed import GROUP, LINES, durations

from axisync_client import Program
from axisync_robot.arm import Arm
from axisync_schemas.cell import read_cell
from axisync_schemas.moves import LinearMove, SequenceMove
from axisync_service.main import CELLS
from axisync_service.planner.models import Models
from support.logread import Log

SHOWN = (TO_P2, LINE, LINE_PARABOLIC, CHANGE, CHANGE_PARABOLIC, POINTS)


def measured(log: Log) -> str:
    """Duration, how straight lines are, and how much of the joints' limits is used, of each move."""
    lines = [
        "| | takes | stretched | tool off its line | joint V, A, J used |",
        "|---|---|---|---|---|",
    ]
    for program in SHOWN:
        move = recorded(log, program)
        off = deviation(log, program, move)
        straight = "" if off is None else "below 0.1 nm" if off < 1e-10 else f"{off * 1e9:.2g} nm"
        scale = f"{move.scale:.3f}" if move.scale > 1.0 else ""
        used = ", ".join(f"{100 * share:.1f}" for share in shares(log, program, move))
        lines.append(f"| {program.name} | {move.duration:.3f} s | {scale} | {straight} | {used} % |")
    return "\n".join(lines)


def shares(log: Log, program: Program, move: Recorded) -> list[float]:
    """The largest velocity, acceleration and jerk of any joint by differences of logged positions, of its limit."""
    axes = [log.cell.axes[i].limits for i in log.cell.axis_indices(program.group)]
    limits = np.array([(axis.velocity, axis.acceleration, axis.jerk) for axis in axes]).T
    found = []
    for order in (1, 2, 3):
        change = np.diff(move.states[0], order, axis=0) / log.cell.period**order
        found.append(float((np.abs(change) / limits[order - 1]).max()))
    return found


def deviation(log: Log, program: Program, move: Recorded) -> float | None:
    """m: the farthest that the tool is from the line between its ends, in any linear step."""
    arm = Arm.of(log.cell.groups[log.cell.members(program.group)[0]])
    assert arm is not None
    tool = arm.placements(move.states[0])[:, :3, 3]
    steps = program.move.steps if isinstance(program.move, SequenceMove) else (program.move,)
    edges = np.searchsorted(move.times, [*(move.steps or (0.0,)), move.duration])
    off = [
        _off_line(tool[low : high + 1], arm, move.states[0][[low, min(high, len(tool) - 1)]])
        for step, low, high in zip(steps, edges[:-1], edges[1:], strict=True)
        if isinstance(step, LinearMove)
    ]
    return max(off, default=None)


def _off_line(tool: Array, arm: Arm, ends: Array) -> float:
    first, last = arm.placements(ends)[:, :3, 3]
    along = (last - first) / np.linalg.norm(last - first)
    return float(np.linalg.norm(np.cross(tool - first, along), axis=1).max())


def retimed() -> str:
    """Durations of lines, here and by TOPP-RA."""
    models = Models(read_cell(CELLS / "eod.toml")[0])
    lines = [
        f"| line of {GROUP} | as asked | V, A, J of joints | V, A of joints | TOPP-RA, V, A of joints |",
        "|---|---|---|---|---|",
    ]
    for found in durations(models):
        best = "" if found.toppra is None else f"{found.toppra:.2f} s"
        lines.append(
            f"| {found.name} | {found.planned:.2f} s | {found.joints:.2f} s | {found.no_jerk:.2f} s | {best} |"
        )
    assert len(lines) == len(LINES) + 2
    return "\n".join(lines)
