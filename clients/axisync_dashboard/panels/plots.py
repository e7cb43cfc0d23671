"""Curves of the chosen group's axes: setpoints, and the actual position as a broad pale line."""

import math
from pathlib import Path
from typing import Any

from nicegui import ui

from axisync_dashboard.decimation import QUANTITIES
from axisync_dashboard.elements import panel
from axisync_dashboard.tab import Tab

STATIC = Path(__file__).parents[1] / "static"
DEGREES = 180.0 / math.pi

PLOTS: tuple[tuple[str, str, str, float, float], ...] = (
    ("Position", "deg", "position", DEGREES, 1.0),
    ("Velocity", "deg/s", "velocity", DEGREES, 1.0),
    ("Acceleration", "deg/s²", "acceleration", DEGREES, 1.0),
    ("Jerk", "deg/s³", "jerk", DEGREES, 1.0),
    ("Following error", "mdeg", "error", 1e3 * DEGREES, 2.0),
)
"""Title, unit, quantity, its factor, and the least range shown, so that noise looks like noise."""


class PlotsView(ui.element, component=STATIC / "plots_view.js"):
    """Curves of some axes."""

    def __init__(self) -> None:
        super().__init__()
        self._props["plots"] = [_plot(*row) for row in PLOTS]

    def show(self, names: list[str], columns: list[int]) -> None:
        """These axes, by their indices in the cell's order."""
        self._props["names"] = names
        self._props["columns"] = columns
        self.update()


def _plot(title: str, unit: str, quantity: str, factor: float, least: float) -> dict[str, Any]:
    plot: dict[str, Any] = {"title": title, "unit": unit, "factor": factor, "least": least}
    plot["quantity"] = QUANTITIES.index(quantity)
    if quantity == "position":
        plot["actual"] = QUANTITIES.index("actual")
    return plot


def build(tab: Tab) -> None:
    """The panel."""
    with panel("Last 20 seconds"):
        view = PlotsView()

    def show() -> None:
        columns = list(tab.cell.axis_indices(tab.group))
        view.show([tab.cell.axes[i].name for i in columns], columns)

    tab.on_group.append(show)
    show()
