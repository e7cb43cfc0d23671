"""Draws curves of a plan: position, velocity, acceleration and jerk of every axis. Needs matplotlib, an extra."""

import logging
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from axisync_cli.plan_curves import Array, Curves
from axisync_client import AxisyncError, ErrorCode

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANELS = (("position", ""), ("velocity", "/s"), ("acceleration", "/s²"), ("jerk", "/s³"))
GREY = "#7a828c"
"""Of text and axes: as far from white as from black, so that a transparent picture is readable on both."""
COLOURS = ("#2f81c7", "#d8604a", "#b98a00", "#9a6dd0", "#37965a", "#1aa0b4")
"""Axis by axis; the next six are the same, dashed."""
STRAIGHT = 1e-6
"""Of the height of a curve: points this close to a straight line are on it."""
STYLE: dict[Any, Any] = {
    "axes.edgecolor": GREY, "axes.facecolor": "none", "axes.labelcolor": GREY, "axes.linewidth": 0.6,
    "axes.spines.right": False, "axes.spines.top": False, "axes.titlecolor": GREY, "axes.titlelocation": "left",
    "axes.titlesize": 9.0, "font.sans-serif": ["DejaVu Sans"], "font.size": 8.0, "grid.alpha": 0.3, "grid.color": GREY,
    "grid.linewidth": 0.5, "legend.frameon": False, "legend.labelcolor": GREY, "lines.linewidth": 1.3,
    "path.simplify": False, "savefig.dpi": 160, "svg.fonttype": "none", "svg.hashsalt": "axisync",
    "xtick.color": GREY, "ytick.color": GREY,
}  # fmt: skip


class PlotFailed(AxisyncError):
    """No picture: matplotlib is missing, or the file cannot be written."""

    code = ErrorCode.UNAVAILABLE


def require() -> None:
    """Raises PlotFailed without matplotlib, before anything else is done."""
    if find_spec("matplotlib") is None:
        fix = f"run `{sys.executable} -m pip install matplotlib` (the extra `plot`)"
        raise PlotFailed("a picture needs matplotlib, which is not installed", fix)


def refuse_steps() -> None:
    """Raises PlotFailed for a sequence: its plan has durations, not curves."""
    raise PlotFailed("a program of several steps has no curves in its plan", "draw its steps one by one")


def save(curves: Curves, path: Path) -> None:
    """Writes the picture, on white, in the format that the ending of `path` names.

    Raises:
        PlotFailed: no matplotlib, or the file cannot be written.
    """
    require()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells of its caches, on stderr
    try:
        write(draw(curves), path, background="white")
    except OSError as error:
        raise PlotFailed(f"{path} cannot be written: {error.strerror or error}") from None


def draw(curves: Curves, size: tuple[float, float] = (8.0, 5.0)) -> "Figure":
    """The picture, `size` inches; each line's id is its panel and the number of its axis: `velocity-1`."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        figure = Figure(figsize=size)
        height = size[1]
        rows = -(-len(curves.names) // 6) if len(curves.names) > 1 else 0
        bottom = (0.44 + 0.2 * rows) / height
        panels = figure.subplots(2, 2, sharex=True)
        figure.subplots_adjust(0.52 / size[0], bottom, 1 - 0.12 / size[0], 1 - 0.24 / height, 0.2, 0.26)
        for order, (panel, (name, per)) in enumerate(zip(panels.flat, PANELS, strict=True)):
            panel.set_title(", ".join([name, *(f"{unit}{per}" for unit in curves.unit.split(", "))]))
            _lines(panel, curves, order, name)
        for panel in panels[1]:
            panel.set_xlabel("time, s", labelpad=2.0)
        if rows:
            figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower center", ncols=6)
    return figure


def write(figure: "Figure", path: Path, background: str = "none") -> None:
    """Writes a picture that `draw` made, without the date: the same curves give the same bytes."""
    from matplotlib import rc_context

    metadata = {"Date": None, "Creator": None} if path.suffix == ".svg" else None
    with rc_context(STYLE):
        figure.savefig(path, facecolor=background, metadata=metadata)


def _lines(panel: "Axes", curves: Curves, order: int, name: str) -> None:
    for number, label in enumerate(curves.names):
        colour, style = COLOURS[number % len(COLOURS)], "-" if number < len(COLOURS) else "--"
        points = corners(curves.times[number], curves.values[number][order])
        (line,) = panel.plot(*points, style, color=colour, label=label)
        line.set_gid(f"{name}-{number + 1}")
    panel.margins(x=0.015)
    panel.grid(True)
    panel.tick_params(length=0.0)
    panel.locator_params(nbins=6)


def corners(times: Array, values: Array) -> tuple[Array, Array]:
    """Without the points on the straight line from the last one kept to the next: files stay small."""
    kept, near = [0], STRAIGHT * np.ptp(values)
    for i in range(1, len(times) - 1):
        last = kept[-1]
        t, v = times[i + 1] - times[last], values[i + 1] - values[last]
        if t == 0.0 or abs(values[last] + v * ((times[i] - times[last]) / t) - values[i]) > near:
            kept.append(i)
    kept.append(len(times) - 1)
    return times[kept], values[kept]
