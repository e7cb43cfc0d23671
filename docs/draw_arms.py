"""Draws the pictures of arms.md and writes its tables: `python docs/draw_arms.py [--log FILE]...`.

Without a log it plays the moves of `arms_log` on a service of its own, in about two minutes.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(1, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(1, str(Path(__file__).parents[1] / "tests" / "bench"))

import numpy as np
from arms_log import CHANGE, CHANGE_PARABOLIC, LINE, LINE_PARABOLIC, POINTS, TO_P2, Array, Recorded, play, recorded
from arms_tables import measured, retimed
from arms_views import curves, draw_jerks, draw_views
from draw_figures import FIGURES, SIZE, marks, table_in

from axisync_cli import plan_plot
from axisync_cli.plan_curves import Curves
from axisync_client import Program
from axisync_robot.arm import Arm
from axisync_robot.poses import zyz_of_rotation
from support.logread import Log, read_log

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = Path(__file__).parent / "arms.md"
VIEWS_SIZE, JERKS_SIZE = (7.0, 3.4), (7.0, 2.6)
TOOLS = {
    "A": (-0.2719, 0.157, 0.3), "B": (-0.2719, 0.157, 0.1), "C": (-0.3484, 0.23, 0.3), "D": (-0.3484, 0.23, 0.1),
}  # fmt: skip
"""Section V.C.2, m in O."""


def arm_of(log: Log, program: Program) -> Arm:
    """The arm that a program moves."""
    arm = Arm.of(log.cell.groups[log.cell.members(program.group)[0]])
    assert arm is not None
    return arm


def joints(log: Log, program: Program) -> "Figure":
    """Position, velocity, acceleration and jerk of every joint, as logged: Figures 20, 28 and 31."""
    move = recorded(log, program)
    return plan_plot.draw(_degrees(move), SIZE)


def _degrees(move: Recorded) -> Curves:
    names = tuple(f"axis {i + 1}" for i in range(move.states.shape[2]))
    return curves(names, move.times, np.degrees(move.states), "deg")


def jerks(log: Log, before: Program, after: Program) -> "Figure":
    """Figures 20(d) and 31(d), before and after."""
    return draw_jerks(_degrees(recorded(log, before)), _degrees(recorded(log, after)), JERKS_SIZE)


def differences(values: Array, period: float) -> Array:
    """[4, k, n] of values [k, n] a tick apart, and their derivatives by differences; the ends are left at rest."""
    padded = np.pad(values, ((2, 2), (0, 0)), mode="edge")
    first, second, middle, fourth, fifth = (padded[i : len(padded) - 4 + i] for i in range(5))
    velocity = (fourth - second) / (2.0 * period)
    acceleration = (fourth - 2.0 * middle + second) / period**2
    jerk = (fifth - 2.0 * fourth + 2.0 * second - first) / (2.0 * period**3)
    return np.stack([values, velocity, acceleration, jerk])


def angles(log: Log) -> "Figure":
    """Figure 18: the tool's ZYZ angles in the arm's base frame, from the logged joints."""
    move, arm = recorded(log, LINE), arm_of(log, LINE)
    turned = arm.base[:3, :3].T @ arm.placements(move.states[0])[:, :3, :3]
    values = np.degrees(np.unwrap(zyz_of_rotation(turned), axis=0))
    values[:, 2] -= 360.0 * np.round((values[0, 2] + 180.0) / 360.0)
    states = differences(values, log.cell.period)
    return plan_plot.draw(curves(("alpha", "beta", "gamma"), move.times, states, "deg"), SIZE)


def length(log: Log) -> "Figure":
    """Figure 19: how far the tool has come, from the logged joints."""
    move, arm = recorded(log, LINE), arm_of(log, LINE)
    tool = arm.placements(move.states[0])[:, :3, 3]
    way = np.linalg.norm(tool - tool[0], axis=1)[:, np.newaxis] * 1e3
    return plan_plot.draw(curves(("",), move.times, differences(way, log.cell.period), "mm"), SIZE)


def path(log: Log, program: Program, names: str) -> "Figure":
    """Where the tool goes: Figures 17 and 27; `names` of the joint positions at its steps' ends."""
    move, arm = recorded(log, program), arm_of(log, program)
    ends = [*move.steps[1:], move.duration] if move.steps else [0.0, move.duration]
    poses = [move.states[0][np.searchsorted(move.times, end, "right") - 1] for end in ends]
    points = dict(zip(names.split(), (arm.placement(pose)[:3, 3] for pose in poses), strict=True))
    return draw_views(log.cell, arm, move.states[0], poses, points, VIEWS_SIZE)


def change(log: Log) -> "Figure":
    """Figures 29 and 30: the tool change, with the equipment box."""
    move, arm = recorded(log, CHANGE), arm_of(log, CHANGE)
    points = {name: np.array(point) for name, point in TOOLS.items()}
    return draw_views(log.cell, arm, move.states[0], [move.states[0][-1]], points, VIEWS_SIZE)


DRAWINGS: dict[str, Callable[[Log], "Figure"]] = {
    "arms-17": partial(path, program=TO_P2, names="P1 P2"),
    "arms-18": angles,
    "arms-19": length,
    "arms-20": partial(joints, program=LINE),
    "arms-20d": partial(jerks, before=LINE, after=LINE_PARABOLIC),
    "arms-27": partial(path, program=POINTS, names="P1 P2 P3"),
    "arms-28": partial(joints, program=POINTS),
    "arms-30": change,
    "arms-31": partial(joints, program=CHANGE),
    "arms-31d": partial(jerks, before=CHANGE, after=CHANGE_PARABOLIC),
}
"""By the number of the paper's figure."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, action="append", help="files of one run in which the moves were played")
    options = parser.parse_args()
    if options.log:
        log = read_log(*options.log)
    else:
        with tempfile.TemporaryDirectory(prefix="axisync-arms-") as directory:
            log = play(Path(directory))
    for name, draw in DRAWINGS.items():
        plan_plot.write(draw(log), FIGURES / f"{name}.svg")
    page = PAGE.read_text(encoding="utf-8")
    for name, table in {"log": measured(log), "retimed": retimed()}.items():
        begin, _ = marks(name)
        page = page.replace(begin + table_in(page, name), begin + table)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
