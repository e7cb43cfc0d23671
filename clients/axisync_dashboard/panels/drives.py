"""A row for each drive: where it is, how far off, and what is wrong with it."""

from nicegui import ui

from axisync_dashboard.elements import live_text, panel
from axisync_schemas.cell import Cell

COLUMNS = (
    ("Position °", "position"),
    ("Error m°", "error"),
    ("Drive", "drive"),
    ("NMT", "nmt"),
    ("Torque", "torque"),
    ("Temp.", "temperature"),
    ("Link", "voltage"),
    ("", "fault"),
)


def build(cell: Cell) -> None:
    """The panel."""
    with panel("Drives"), ui.element("div").classes("scroll-x"), ui.element("table").classes("table"):
        with ui.element("thead"), ui.element("tr"):
            for title in ("Axis", *(title for title, _ in COLUMNS)):
                with ui.element("th"):
                    ui.label(title)
        with ui.element("tbody"):
            for i, axis in enumerate(cell.axes):
                with ui.element("tr"):
                    with ui.element("td"):
                        ui.label(axis.name)
                    for _, key in COLUMNS:
                        with ui.element("td"):
                            live_text(f"a{i}.{key}", key)
