"""enable, disable, reset, stop: about a whole group, over in a moment."""

import typer

from axisync_cli import sentences
from axisync_cli.options import EPILOG, GroupOrAll, Json, terminal_of
from axisync_cli.terminal import Terminal
from axisync_schemas.replies import GroupReply


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (enable, disable, reset, stop):
        app.command(epilog=EPILOG)(command)


def enable(context: typer.Context, group: GroupOrAll = "all", as_json: Json = False) -> None:
    """Switch drives on; they hold their positions."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, client.lease(group) as lease:
        _done(terminal, lease.enable())


def disable(context: typer.Context, group: GroupOrAll = "all", as_json: Json = False) -> None:
    """Switch drives off."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, client.lease(group) as lease:
        _done(terminal, lease.disable())


def reset(context: typer.Context, group: GroupOrAll = "all", as_json: Json = False) -> None:
    """Acknowledge faults."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, client.lease(group) as lease:
        _done(terminal, lease.reset())


def stop(context: typer.Context, group: GroupOrAll = "all", as_json: Json = False) -> None:
    """Stop what moves, on its path. Needs no lease. Not an emergency stop: that is the hard-wired one."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client:
        _done(terminal, client.stop(group))


def _done(terminal: Terminal, reply: GroupReply) -> None:
    terminal.reply(reply)
    terminal.show(sentences.of_states(reply.groups))
