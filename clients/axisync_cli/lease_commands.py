"""lease: who may move what, and holding a group against everybody else."""

import json
import time

import typer

from axisync_cli.options import EPILOG, Json, OptionalGroup, Take, terminal_of
from axisync_cli.state_table import lease_table
from axisync_cli.terminal import Terminal
from axisync_client import InvalidArgument
from axisync_schemas.replies import State

LOOK_S = 0.1


def add_to(app: typer.Typer) -> None:
    """Adds the command."""
    app.command(epilog=EPILOG)(lease)


def lease(context: typer.Context, group: OptionalGroup = None, take: Take = False, as_json: Json = False) -> None:
    """Show who holds which group; with GROUP, hold it until Ctrl-C."""
    terminal = terminal_of(context, as_json, group)
    if group is not None:
        _hold(terminal, group, take)
    if take:
        raise InvalidArgument("--take takes a group", "say which: `axisync lease GROUP --take`")
    _show(terminal)


def _show(terminal: Terminal) -> None:
    with terminal.connect() as client:
        report = client.state()
    _holders(terminal, report)
    terminal.show(lease_table(report.lease))


def _hold(terminal: Terminal, group: str, take: bool) -> None:
    """Until Ctrl-C, or until the lease is lost."""
    with terminal.connect() as client, terminal.lease(client, group, take) as held:
        _holders(terminal, client.state())
        terminal.show(f"{client.user} holds {group} until Ctrl-C: nobody else moves it; whoever wants may stop it")
        while True:
            held.check()
            time.sleep(LOOK_S)


def _holders(terminal: Terminal, report: State) -> None:
    if terminal.as_json:
        terminal.json_line(json.dumps({"now_s": report.now_s, "lease": report.lease}))
