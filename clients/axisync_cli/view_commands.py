"""state, watch, events, lease: looking, without touching."""

import json
from datetime import datetime

import typer
from rich.live import Live
from rich.text import Text

from axisync_cli.options import EPILOG, Json, terminal_of
from axisync_cli.state_table import lease_table, state_table
from axisync_schemas.replies import Event

_STYLES = {"warning": "yellow", "error": "bold red"}
WATCH_DECIMATION = 2
"""Of 20 states a second, one in two is drawn."""


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (state, watch, events, lease):
        app.command(epilog=EPILOG)(command)


def state(context: typer.Context, as_json: Json = False) -> None:
    """Show groups, positions, drives, leases, cycle, buses and recorder."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client:
        report = client.state()
    terminal.reply(report)
    terminal.show(state_table(report))


def watch(context: typer.Context, as_json: Json = False) -> None:
    """Show the state, live, until Ctrl-C."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client, client.states() as states:
        if as_json:
            for report in states:
                terminal.reply(report)
            return
        with Live(console=terminal.out, auto_refresh=False, screen=terminal.out.is_terminal) as live:
            for number, report in enumerate(states):
                if number % WATCH_DECIMATION == 0:
                    live.update(state_table(report), refresh=True)


def events(context: typer.Context, as_json: Json = False) -> None:
    """Print what happens, a line each, until Ctrl-C."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client, client.events() as stream:
        for event in stream:
            terminal.reply(event)
            terminal.show(_line(event))


def lease(context: typer.Context, as_json: Json = False) -> None:
    """Show who holds which group."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client:
        report = client.state()
    if as_json:
        terminal.json_line(json.dumps({"now_s": report.now_s, "lease": report.lease}))
    terminal.show(lease_table(report.lease))


def _line(event: Event) -> Text:
    """`12:00:01.500 controller kingkong move_started: message`, in local time."""
    about = f" {event.group}" if event.group and event.group not in event.message else ""
    text = f"{_local_time(event.wall_time)} {event.source}{about} {event.kind}: {event.message}"
    return Text(text, style=_STYLES.get(event.severity, ""))


def _local_time(stamp: str) -> str:
    try:
        return datetime.fromisoformat(stamp).astimezone().strftime("%H:%M:%S.%f")[:-3]
    except ValueError:
        return stamp
