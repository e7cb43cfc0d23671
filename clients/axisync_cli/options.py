"""The options commands share, and global options wherever on the line they are written."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from axisync_cli import quantities
from axisync_cli.terminal import Terminal

T = TypeVar("T")
GLOBAL = ("--endpoint", "--cell", "--user", "--timeout")
EPILOG = "Also: --endpoint, --cell, --user and --timeout, see `axisync --help`."


@dataclass(frozen=True, slots=True)
class Target:
    """Value of --joint: rad, one for each axis. A class of its own, or typer reads a tuple as several words."""

    values: tuple[float, ...]


def _target(text: str) -> Target:
    return Target(quantities.joint_target(text))


def _in_words(parse: Callable[[str], T]) -> Callable[[str | T], T]:
    """The same parser with its sentence as a usage error; typer sends defaults through it, too."""

    def parser(text: str | T) -> T:
        try:
            return parse(text) if isinstance(text, str) else text
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None

    return parser


Json = Annotated[bool, typer.Option("--json", help="Print the reply or the error body as JSON.")]
Group = Annotated[str, typer.Argument(metavar="GROUP", help="A group or a compound of the cell.")]
GroupOrAll = Annotated[str, typer.Argument(metavar="[GROUP]", help="A group, a compound, or all.", show_default=True)]
Joint = Annotated[
    Target,
    typer.Option(
        "--joint",
        metavar="VALUES",
        parser=_in_words(_target),
        help="One value for each axis: -90,60,-45,0,0,0deg, or 90deg,0.5rad,...; without a unit they are radians.",
    ),
]
Relative = Annotated[bool, typer.Option("--relative", help="Add the values to the present setpoint.")]
Minimise = Annotated[
    quantities.Minimise,
    typer.Option("--minimise", help="Which limit to lower on the axes that have time to spare."),
]
Duration = Annotated[
    float | None,
    typer.Option(
        "--duration",
        metavar="SECONDS",
        parser=_in_words(quantities.duration_s),
        help="Take this long instead of the shortest possible time.",
    ),
]
PulseShape = Annotated[
    quantities.Pulse, typer.Option("--pulse", help="Shape of the jerk; with parabolic the jerk is continuous.")
]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        parser=_in_words(quantities.picture),
        help="Draw position, velocity, acceleration and jerk: FILE.svg or FILE.png.",
    ),
]
Speed = Annotated[
    float,
    typer.Option(
        "--speed", metavar="SHARE", parser=_in_words(quantities.speed_scale), help="Of the limits: 50% or 0.5."
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
