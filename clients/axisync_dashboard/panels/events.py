"""What happened, newest first; the browser adds the rows."""

from nicegui import ui

from axisync_dashboard.elements import panel


def build() -> None:
    """The panel."""
    with panel("Events"):
        ui.element("div").classes("events").props("id=events")
        ui.label("Times are UTC.").classes("hint")
