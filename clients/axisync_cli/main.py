"""The `axisync` command: global options, the commands, and one place where errors become sentences and exit codes."""

import logging
import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from axisync_cli import (
    drive_commands,
    foxglove_command,
    group_commands,
    jog_command,
    lease_commands,
    move_commands,
    review_commands,
    sentences,
    view_commands,
)
from axisync_cli.entry import EXIT_INTERRUPTED
from axisync_cli.options import hoist
from axisync_cli.terminal import Terminal
from axisync_client import AxisyncError, InvalidArgument
from axisync_client.discovery import own_version
from axisync_schemas import SCHEMA_VERSION

EXIT_DONE, EXIT_FAILED, EXIT_USAGE = 0, 1, 2

app = typer.Typer(
    name="axisync",
    help="Commands for an axisync daemon: look, enable, move, stop.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _say_version(wanted: bool) -> None:
    if wanted:
        print(f"axisync {own_version()}, schema {SCHEMA_VERSION}")
        raise typer.Exit


@app.callback(epilog="Exit status: 0 done, 1 refused or failed, 2 usage, 130 interrupted.")
def _global_options(
    context: typer.Context,
    endpoint: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="HOST:PORT; else AXISYNC_ENDPOINT, then 127.0.0.1:7447.")
    ] = None,
    cell: Annotated[
        str | None, typer.Option(metavar="NAME", help="Else AXISYNC_CELL, then the only cell that answers.")
    ] = None,
    user: Annotated[str | None, typer.Option(metavar="NAME", help="Else AXISYNC_USER, then anonymous.")] = None,
    timeout: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.1, max=3600.0, help="How long to wait for an answer.")
    ] = 5.0,
    lease_ttl: Annotated[
        float,
        typer.Option(metavar="SECONDS", min=0.2, max=60.0, help="Silence after which what this command moves is held."),
    ] = 2.0,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_say_version, help="Say which version this is.")
    ] = False,
) -> None:
    terminal: Terminal = context.ensure_object(Terminal)
    terminal.endpoint, terminal.cell, terminal.user = endpoint, cell, user
    terminal.timeout_s, terminal.lease_ttl_s = timeout, lease_ttl


view_commands.add_to(app)
lease_commands.add_to(app)
group_commands.add_to(app)
move_commands.add_to(app)
jog_command.add_to(app)
drive_commands.add_to(app)
foxglove_command.add_to(app)
review_commands.add_to(app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command line and returns its exit code. Never shows a traceback, unless AXISYNC_DEBUG is set."""
    terminal = Terminal()
    logging.getLogger("axisync_client").addHandler(logging.NullHandler())  # its errors are said by us, once
    try:
        app(hoist(sys.argv[1:] if arguments is None else arguments), prog_name="axisync", obj=terminal)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else EXIT_FAILED
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except AxisyncError as error:
        return _refused(terminal, error)
    except Exception as error:
        if os.environ.get("AXISYNC_DEBUG"):
            raise
        terminal.say(f"axisync has a fault of its own ({type(error).__name__}: {error}): AXISYNC_DEBUG=1 shows where")
        return EXIT_FAILED
    return EXIT_DONE


def _refused(terminal: Terminal, error: AxisyncError) -> int:
    if terminal.as_json:
        terminal.json_line(error.body().model_dump_json())
    else:
        terminal.say(sentences.of_error(error, terminal.group))
    return EXIT_USAGE if isinstance(error, InvalidArgument) else EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
