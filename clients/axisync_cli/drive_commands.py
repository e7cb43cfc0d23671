"""home and drive: finding homes, and a drive's objects for maintenance."""

from typing import Annotated

import typer

from axisync_cli import sentences
from axisync_cli.interrupts import stop_and_wait
from axisync_cli.options import EPILOG, GroupOrAll, Json, Take, terminal_of
from axisync_client.drives import Value, group_of, read_object, write_object
from axisync_schemas.replies import DriveReply

Axis = Annotated[str, typer.Argument(metavar="AXIS", help="An axis of the cell.")]
Object = Annotated[str, typer.Argument(metavar="OBJECT", help="0x6079, 0x2002:1, or a name of the EDS.")]
NewValue = Annotated[str | None, typer.Argument(metavar="VALUE", help="Write it; the group must be disabled.")]


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    app.command("home", epilog=EPILOG)(home_group)
    app.command("drive", epilog=EPILOG, context_settings={"ignore_unknown_options": True})(drive)


def home_group(context: typer.Context, group: GroupOrAll = "all", take: Take = False, as_json: Json = False) -> None:
    """Find the homes of a group's drives. They move by themselves: nothing checks for collisions. Ctrl-C stops them."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        try:
            reply = lease.home()
        except KeyboardInterrupt:
            raise typer.Exit(stop_and_wait(terminal, client, group)) from None
        terminal.reply(reply)
        terminal.show(sentences.of_states(reply.groups))


def drive(
    context: typer.Context,
    axis: Axis,
    name: Object,
    value: NewValue = None,
    take: Take = False,
    as_json: Json = False,
) -> None:
    """Read an object of a drive, or write it."""
    terminal = terminal_of(context, as_json)
    with terminal.connect() as client:
        if value is None:
            reply = read_object(client, axis, name)
        else:
            terminal.group = group_of(client.config(), axis)
            with terminal.lease(client, terminal.group, take) as lease:
                reply = write_object(lease, axis, name, parsed(value))
        terminal.reply(reply)
        terminal.show(in_words(reply))


def parsed(text: str) -> Value:
    """A whole number (decimal or 0x), a number, or text."""
    try:
        return int(text, 0)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return text


def in_words(reply: DriveReply) -> str:
    """`kingkong.1 0x6079:0 (DC link circuit voltage) = 48000 (0xBB80)`."""
    name = f" ({reply.name})" if reply.name else ""
    shown = f"{reply.data or '-'} (bytes)" if reply.value is None else str(reply.value)
    if isinstance(reply.value, int):
        bits = 4 * len(reply.data)
        shown += f" (0x{reply.value % (1 << bits):0{len(reply.data)}X})" if bits else ""
    return f"{reply.axis} {reply.object}{name} = {shown}"
