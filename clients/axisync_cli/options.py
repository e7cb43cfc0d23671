"""The options commands share, and global options wherever on the line they are written."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from axisync_cli import quantities
from axisync_cli.terminal import Terminal

T = TypeVar("T")
GLOBAL = ("--endpoint", "--cell", "--user", "--timeout", "--lease-ttl")
EPILOG = "Also: --endpoint, --cell, --user, --timeout and --lease-ttl, see `axisync --help`."


def in_words(parse: Callable[[str], T]) -> Callable[[str | T], T]:
    """The same parser with its sentence as a usage error; typer sends defaults through it, too."""

    def parser(text: str | T) -> T:
        try:
            return parse(text) if isinstance(text, str) else text
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None

    return parser


Json = Annotated[bool, typer.Option("--json", help="Print the reply or the error body as JSON.")]
GroupOrAll = Annotated[str, typer.Argument(metavar="GROUP", help="A group, a compound, or all.", show_default=True)]
OptionalGroup = Annotated[str | None, typer.Argument(metavar="GROUP", help="A group, a compound, or all.")]
Take = Annotated[bool, typer.Option("--take", help="Take the lease from whoever holds it; what moves goes on.")]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        parser=in_words(quantities.picture),
        help="Draw position, velocity, acceleration and jerk: FILE.svg or FILE.png.",
    ),
]
Speed = Annotated[
    float,
    typer.Option(
        "--speed",
        metavar="SHARE",
        parser=in_words(quantities.speed_scale),
        help="Of the limits, or of a program's own speed: 50% or 0.5.",
    ),
]


def terminal_of(context: typer.Context, as_json: bool, group: str | None = None) -> Terminal:
    """The terminal, told in what form this command prints and what it is about."""
    terminal: Terminal = context.ensure_object(Terminal)
    terminal.as_json, terminal.group = as_json, group
    return terminal


def hoist(arguments: Sequence[str]) -> list[str]:
    """Global options moved to the front, so that they may stand after the command as well."""
    front: list[str] = []
    rest = list(arguments)
    kept: list[str] = []
    while rest:
        word = rest.pop(0)
        if word == "--":
            return [*front, *kept, word, *rest]
        if word in GLOBAL and rest:
            front += [word, rest.pop(0)]
        elif "=" in word and word.split("=", 1)[0] in GLOBAL:
            front.append(word)
        else:
            kept.append(word)
    return front + kept
