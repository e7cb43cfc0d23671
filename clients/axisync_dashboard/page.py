"""The page: what is where."""

from pathlib import Path

from nicegui import Client as Browser
from nicegui import ui

from axisync_dashboard.link import DaemonLink
from axisync_dashboard.panels import (
    arms,
    cycle,
    drives,
    events,
    header,
    jog,
    joints,
    logs,
    plots,
    power,
    programs,
    tool,
)
from axisync_dashboard.tab import Tab

REFRESH_S = 0.1


def build(browser: Browser, link: DaemonLink, programs_directory: Path | None) -> Tab | None:
    """Fills the page; None while no daemon was ever there: it loads anew when one comes."""
    generation, cell = link.telemetry.generation, link.telemetry.cell
    ui.add_head_html(
        f'<script>window.axisyncPage = {{client: "{browser.id}", cell: {generation}}};</script>'
        '<link rel="stylesheet" href="/static/style.css"><script src="/static/live.js"></script>'
    )
    ui.colors(primary="#1d5fb4")
    if cell is None:
        header.build(None)
        ui.label("Waiting for the daemon.").classes("waiting")
        return None
    tab = Tab(browser, link, cell)
    header.build(tab)
    with ui.element("main").classes("layout"):
        with ui.element("div").classes("wide"):
            view = arms.build(cell)
            plots.build(tab)
            drives.build(cell)
        with ui.element("div").classes("narrow"):
            power.build(tab)
            _motion(tab, view, programs_directory)
            cycle.build(cell)
            events.build()
            logs.build(tab)
    ui.timer(REFRESH_S, tab.refresh)
    return tab


def _motion(tab: Tab, view: arms.ArmsView | None, programs_directory: Path | None) -> None:
    with ui.element("section").classes("panel from-daemon"):
        with ui.tabs().props("dense no-caps align=justify").classes("motion-tabs") as tabs:
            names = [ui.tab(name) for name in ("Joints", "Tool", "Jog", "Programs")]
        with ui.tab_panels(tabs, value=names[0], animated=False, keep_alive=True).classes("motion"):
            with ui.tab_panel(names[0]):
                joints.JointForm(tab, view)
            with ui.tab_panel(names[1]):
                tool.ToolForm(tab, view)
            with ui.tab_panel(names[2]):
                jog.JogPads(tab)
            with ui.tab_panel(names[3]):
                programs.Programs(tab, view, programs_directory)
