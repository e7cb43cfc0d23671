"""Pictures of arms.md: where a tool goes, from above and from the side, and curves thinned to what can be seen."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from axisync_cli.plan_curves import Curves
from axisync_cli.plan_plot import COLOURS, GREY, STYLE
from axisync_robot.arm import Arm
from axisync_schemas.cell import Cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

VISIBLE = 5e-4
"""Of a panel's height: what a curve may be off after thinning."""
MM = 1e3
CORNERS = np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])
VIEWS = (("from above, mm", 0, 1), ("from the side, mm", 0, 2))
"""Title, and which coordinates of O are to the right and up."""


def thinned(times: Array, values: Array) -> tuple[Array, Array]:
    """Some of the samples of values [m, k]: straight lines between them are off by no more than VISIBLE of each row.

    Douglas and Peucker's division, over all rows at once.
    """
    heights = np.ptp(values, axis=1)
    scaled = values / np.where(heights > 0.0, heights, 1.0)[:, np.newaxis]
    kept = {0, len(times) - 1}
    todo = [(0, len(times) - 1)]
    while todo:
        low, high = todo.pop()
        if high - low < 2:
            continue
        share = (times[low + 1 : high] - times[low]) / (times[high] - times[low])
        chord = scaled[:, [low]] + share * (scaled[:, [high]] - scaled[:, [low]])
        off = np.abs(scaled[:, low + 1 : high] - chord).max(axis=0)
        if off.max() > VISIBLE:
            middle = low + 1 + int(off.argmax())
            kept.add(middle)
            todo += [(low, middle), (middle, high)]
    chosen = sorted(kept)
    return times[chosen], values[:, chosen]


def curves(names: tuple[str, ...], times: Array, states: Array, unit: str) -> Curves:
    """Of states [4, k, n], thinned."""
    thin = [thinned(times, states[:, :, column]) for column in range(states.shape[2])]
    return Curves(names, tuple(t for t, _ in thin), tuple(v for _, v in thin), unit)


def draw_views(
    cell: Cell, arm: Arm, path: Array, poses: list[Array], points: Mapping[str, Array], size: tuple[float, float]
) -> "Figure":
    """The tool's path [k, n] in joint angles, the arm at some `poses` [n] of it, the cell's boxes, named points [3]."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    tool = arm.placements(path)[:, :3, 3] * MM
    with rc_context(STYLE):
        figure = Figure(figsize=size)
        panels = figure.subplots(1, 2)
        figure.subplots_adjust(0.09, 0.12, 0.98, 0.92, 0.22)
        for panel, (title, right, up) in zip(panels.flat, VIEWS, strict=True):
            _boxes(panel, cell, right, up)
            for pose in poses:
                links = _links(arm, pose)
                panel.plot(links[:, right], links[:, up], "-o", color=GREY, alpha=0.5, markersize=2)
            _, places = thinned(np.arange(len(tool), dtype=np.float64), tool[:, [right, up]].T)
            (line,) = panel.plot(*places, color=COLOURS[0])
            line.set_gid(f"tool-{'xyz'[right]}{'xyz'[up]}")
            for name, point in points.items():
                place = (float(point[right]) * MM, float(point[up]) * MM)
                panel.plot(*place, "o", color=COLOURS[1], markersize=3)
                panel.annotate(name, place, (3, 3), textcoords="offset points", color=COLOURS[1])
            panel.set_aspect("equal", adjustable="datalim")
            _plain(panel, title, f"{'xyz'[right]}")
            panel.set_ylabel("xyz"[up], labelpad=0.0)
    return figure


def _plain(panel: "Axes", title: str, below: str) -> None:
    panel.set_title(title)
    panel.set_xlabel(below, labelpad=2.0)
    panel.grid(True)
    panel.tick_params(length=0.0)
    panel.locator_params(nbins=6)


def _links(arm: Arm, pose: Array) -> Array:
    """[m, 3] mm: base, joints' frames, tool."""
    _, origins = arm.chain.frames(pose[np.newaxis], arm.base)
    tool = arm.placement(pose)[:3, 3]
    links: Array = np.concatenate([arm.base[np.newaxis, :3, 3], origins[0], tool[np.newaxis]]) * MM
    return links


def _boxes(panel: "Axes", cell: Cell, right: int, up: int) -> None:
    for number, box in enumerate(cell.geometry.boxes):
        middle, half = np.array(box.pose.position) * MM, np.array(box.size) * (0.5 * MM)
        x, y = middle[right] + half[right] * CORNERS[0], middle[up] + half[up] * CORNERS[1]
        panel.fill(x, y, color=GREY, alpha=0.18, linewidth=0.0)
        side, offset = ("right", (-3, 3)) if number % 2 == 0 else ("left", (3, 3))
        corner = (x[1 - number % 2], y[0])
        panel.annotate(box.name, corner, offset, textcoords="offset points", color=GREY, ha=side)


def draw_jerks(before: Curves, after: Curves, size: tuple[float, float]) -> "Figure":
    """Joint jerk of two moves side by side, at one scale."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        figure = Figure(figsize=size)
        panels = figure.subplots(1, 2, sharey=True)
        figure.subplots_adjust(0.06, 0.64 / size[1], 0.985, 1 - 0.24 / size[1], 0.06)
        for panel, drawn, pulse in zip(panels.flat, (before, after), ("constant", "parabolic"), strict=True):
            for number, label in enumerate(drawn.names):
                (line,) = panel.plot(drawn.times[number], drawn.values[number][3], color=COLOURS[number], label=label)
                line.set_gid(f"{pulse}-{number + 1}")
            _plain(panel, f"jerk, {drawn.unit}/s³: {pulse} pulse", "time, s")
            panel.margins(x=0.015)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="lower center", ncols=6)
    return figure
