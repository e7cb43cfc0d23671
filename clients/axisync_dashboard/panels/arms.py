"""Both arms in 3D, as they stand, with what is planned as ghosts."""

from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.elements import scene

from axisync_dashboard.elements import live_text, panel
from axisync_dashboard.ghosts import Ghost
from axisync_dashboard.kinematics import Array, arms_of, matrix_of
from axisync_schemas.cell import Cell

STATIC = Path(__file__).parents[1] / "static"
USES = scene.Scene
"""Importing it serves three.js to the browser; nothing comes from elsewhere."""


class ArmsView(ui.element, component=STATIC / "arms_view.js"):
    """The 3D view of a cell."""

    def __init__(self, cell: Cell) -> None:
        super().__init__()
        self._props["arms"] = arms_shown(cell)
        self._props["boxes"] = [
            {"matrix": _rows(matrix_of(box.pose)), "size": list(box.size)} for box in cell.geometry.boxes
        ]

    def preview(self, ghosts: dict[str, Ghost]) -> None:
        """Shows what is only planned, instead of what is under way; nothing: ends that."""
        shown = {name: {"end": list(g.end), "path": [list(p) for p in g.path]} for name, g in ghosts.items()}
        self.run_method("setPreview", shown)


def arms_shown(cell: Cell) -> list[dict[str, Any]]:
    """The chains as the browser takes them; `axes` are indices in the cell's order."""
    return [
        {
            "group": arm.group,
            "axes": list(cell.axis_indices(arm.group)),
            "links": [{"fixed": _rows(link.fixed), "capsules": link.capsules} for link in arm.links],
            "tool": _rows(arm.tool),
        }
        for arm in arms_of(cell)
        if arm is not None
    ]


def _rows(matrix: Array) -> list[list[float]]:
    return [[float(value) for value in row] for row in matrix]


def build(cell: Cell) -> ArmsView | None:
    """The panel; None where no group has DH rows, which is said."""
    with panel("Arms"):
        for group in cell.groups:
            with ui.element("div").classes("tool-line"):
                ui.label(group.name)
                live_text(f"g.{group.name}.state", "state")
                live_text(f"g.{group.name}.tool", "tool")
        if not arms_shown(cell):
            ui.label("The cell file has no DH rows: there is nothing to draw.").classes("hint")
            return None
        view = ArmsView(cell)
        ui.label("Tools in mm, in the body's frame. Pale: where a move ends. Drag to turn the view.").classes("hint")
        return view
