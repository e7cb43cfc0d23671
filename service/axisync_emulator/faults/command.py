"""`axisync-emulator inject SOCKET kind=lose bus=kingkong id=0x201 count=5`: a fault in an emulator that runs."""

import json
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from axisync_emulator.faults.control import ask

USAGE, FAILURE = 2, 1

app = typer.Typer(add_completion=False)


@app.command()
def inject(
    socket: Annotated[Path, typer.Argument(help="What the emulator was given as --control.")],
    fields: Annotated[list[str] | None, typer.Argument(help="The fault, as key=value; none: list all faults.")] = None,
    cancel: Annotated[int | None, typer.Option(help="End the fault with this number.")] = None,
) -> None:
    """Makes a fault, ends one, or lists them. Prints the answer as JSON, one fault a line."""
    request: dict[str, object] = {"list": True}
    if cancel is not None:
        request = {"cancel": cancel}
    elif fields:
        request = {"inject": dict(_field(text) for text in fields)}
    try:
        answer = ask(socket, request)
    except OSError as error:
        _fail(f"{socket}: {error.strerror or error}", FAILURE)
    if "error" in answer:
        _fail(str(answer["error"]), FAILURE)
    faults = answer.get("faults", [answer])
    assert isinstance(faults, list)
    print(*(json.dumps(fault) for fault in faults), sep="\n")


def _field(text: str) -> tuple[str, object]:
    """A number, decimal or as 0x..., true, false, or a text."""
    key, equals, value = text.partition("=")
    if not equals:
        _fail(f"{text!r} is not key=value", USAGE)
    if key == "data":  # digits of a frame, never a number
        return key, value
    for parse in (lambda: int(value, 0), lambda: json.loads(value)):
        try:
            return key, parse()
        except ValueError:
            continue
    return key, value


def _fail(message: str, status: int) -> NoReturn:
    print(f"axisync-emulator inject: {message}", file=sys.stderr)
    raise typer.Exit(status)
