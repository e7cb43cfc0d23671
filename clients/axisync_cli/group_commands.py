"""enable, disable, reset, hold, resume, override, stop: about a whole group."""

import math
from collections.abc import Callable
from typing import Annotated

import typer

from axisync_cli import interrupts, sentences
from axisync_cli.options import EPILOG, GroupOrAll, Json, Take, in_words, terminal_of
from axisync_cli.quantities import rate
from axisync_cli.terminal import Terminal
from axisync_client import Client
from axisync_schemas.replies import GroupReply


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (enable, disable, reset, hold, resume, override, stop):
        app.command(epilog=EPILOG)(command)


def enable(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Switch drives on; they hold their positions."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _done(terminal, lease.enable())


def disable(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Switch drives off."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _done(terminal, lease.disable())


def reset(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Acknowledge faults."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _done(terminal, lease.reset())


def hold(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Bring what moves to rest on its path; `resume` goes on."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _done(terminal, lease.hold())


def resume(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Go on with a move that is held, and wait until it has ended. Ctrl-C stops it."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _to_the_end(terminal, client, group, lease.resume)


def override(
    context: typer.Context,
    value: Annotated[float, typer.Argument(metavar="VALUE", parser=in_words(rate), help="30% or 0.3; 100% is full.")],
    group: GroupOrAll = "all",
    take: Take = False,
    as_json: Json = False,
) -> None:
    """Run along paths at a share of their speed, until changed. Waits for what is on its way; Ctrl-C stops it."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        _to_the_end(terminal, client, group, lambda: lease.override(value))


def stop(context: typer.Context, group: GroupOrAll = "all", as_json: Json = False) -> None:
    """Stop what moves, on its path. Needs no lease. Not an emergency stop: that is the hard-wired one."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client:
        _done(terminal, client.stop(group))


def _to_the_end(terminal: Terminal, client: Client, group: str, command: Callable[[], GroupReply]) -> None:
    """Keeps the lease until nothing is on its way: given back before, what moves would be held."""
    try:
        reply = command()
        _done(terminal, reply)
        states = interrupts.stand(client, list(reply.groups), math.inf)
    except KeyboardInterrupt:
        raise typer.Exit(interrupts.stop_and_wait(terminal, client, group)) from None
    if states != reply.groups:
        terminal.show(sentences.of_states(states))


def _done(terminal: Terminal, reply: GroupReply) -> None:
    terminal.reply(reply)
    terminal.show(sentences.of_states(reply.groups))
