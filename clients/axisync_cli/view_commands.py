"""state, watch, events: looking, without touching."""

from typing import Annotated

import typer

from axisync_cli.event_line import event_line
from axisync_cli.options import EPILOG, Json, terminal_of
from axisync_cli.state_table import state_table
from axisync_cli.watch_view import draw
from axisync_schemas.replies import Event

Follow = Annotated[bool, typer.Option("--follow", "-f", help="Go on with what happens, until Ctrl-C.")]
Last = Annotated[int, typer.Option("--last", "-n", metavar="COUNT", min=0, help="How many of the newest.")]


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (state, watch, events):
        app.command(epilog=EPILOG)(command)


def state(context: typer.Context, as_json: Json = False) -> None:
    """Show groups, positions, drives, leases, cycle and buses."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client:
        report = client.state()
    terminal.reply(report)
    terminal.show(state_table(report))


def watch(context: typer.Context, as_json: Json = False) -> None:
    """Show the state and the newest events, live, until Ctrl-C."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client, client.states() as states:
        if as_json:
            for report in states:
                terminal.reply(report)
        else:
            with client.events() as news:
                draw(terminal.out, states, news, client.recent_events())


def events(context: typer.Context, follow: Follow = False, last: Last = 20, as_json: Json = False) -> None:
    """Print what happened, a line each."""
    terminal = terminal_of(context, as_json)

    def tell(event: Event) -> None:
        terminal.reply(event)
        terminal.show(event_line(event))

    with terminal.connect() as client:
        if not follow:
            for event in _newest(client.recent_events(), last):
                tell(event)
            return
        with client.events() as stream:  # before what was is asked for, so that nothing falls in between
            past = client.recent_events()
            for event in _newest(past, last):
                tell(event)
            told = past[-1].seq if past else 0
            for event in stream:
                if event.seq != told:
                    tell(event)


def _newest(past: tuple[Event, ...], count: int) -> tuple[Event, ...]:
    return past[max(0, len(past) - count) :]
