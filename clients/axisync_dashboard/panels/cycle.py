"""How the cycle keeps time, how full the buses are, what the recorder does."""

from nicegui import ui

from axisync_dashboard.decimation import HISTOGRAM_S, LATENESS_EDGES_US
from axisync_dashboard.elements import live_bar, live_text, panel
from axisync_schemas.cell import Cell


def build(cell: Cell) -> None:
    """The panel."""
    with panel("Cycle and buses"):
        live_text("controller", "alarm")
        with ui.element("dl").classes("facts"):
            _fact("Period", "c.period", "c.realtime")
            _fact("Late (p50 / p99 / max)", "c.late")
            _fact("Skipped ticks", "c.skipped")
            _fact("Log", "recorder")
        for bus in cell.buses:
            with ui.element("div").classes("bus"):
                ui.label(f"Bus {bus.name}")
                live_text(f"b.{bus.name}.state", "state")
                live_bar(f"b.{bus.name}.width")
                live_text(f"b.{bus.name}.load", "number")
        ui.label(f"Lateness of ticks, last {HISTOGRAM_S:g} s, logarithmic").classes("hint")
        _histogram()


def _fact(name: str, *keys: str) -> None:
    with ui.element("dt"):
        ui.label(name)
    with ui.element("dd"):
        for key in keys:
            live_text(key)


def _histogram() -> None:
    with ui.element("div").classes("histogram"):
        for i, edge in enumerate(LATENESS_EDGES_US):
            with ui.element("div").classes("bin"):
                with ui.element("div").classes("bin-column"):
                    ui.element("div").props(f"data-bin={i}")
                ui.label(f"{edge:g}" if edge < 1000 else f"{edge / 1000:g}k")
    ui.label("µs and more").classes("hint unit")
