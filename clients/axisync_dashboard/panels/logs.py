"""Log files: download, and review where it is installed."""

import datetime

from nicegui import ui

from axisync_dashboard.elements import panel, plain_button
from axisync_dashboard.log_files import LogFile, can_review, log_files
from axisync_dashboard.tab import Tab
from axisync_dashboard.words import bytes_in_words

SHOWN = 12


def build(tab: Tab) -> None:
    """The panel."""
    with panel("Logs", live=False):
        rows = ui.element("div").classes("logs")
        plain_button("Refresh", lambda: _show(tab, rows), icon="refresh")
    _show(tab, rows)


def _show(tab: Tab, rows: ui.element) -> None:
    info = tab.link.telemetry.info
    files = None if info is None else log_files(info.log_directory)
    rows.clear()
    with rows:
        if files is None:
            ui.label("The logs are on the daemon's machine, and this page's server cannot read them.").classes("hint")
            return
        if not files:
            ui.label("There are no log files yet.").classes("hint")
        for file in files[:SHOWN]:
            _row(file)


def _row(file: LogFile) -> None:
    when = datetime.datetime.fromtimestamp(file.modified_s, datetime.UTC)
    with ui.element("div").classes("log"):
        ui.link(file.name, f"/logs/{file.name}").props(f'download="{file.name}"')
        ui.label(f"{when:%Y-%m-%d %H:%M} UTC, {bytes_in_words(file.size)}").classes("hint")
        if can_review():
            ui.link("Review", f"/review/{file.name}", new_tab=True)
