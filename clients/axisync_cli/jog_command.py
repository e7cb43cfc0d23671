"""jog: move for a time, or until Ctrl-C."""

import math
import time
from collections.abc import Callable
from typing import Annotated, Any

import typer

from axisync_cli import interrupts, quantities, sentences
from axisync_cli.entry import EXIT_INTERRUPTED
from axisync_cli.move_options import Numbers, numbers
from axisync_cli.options import EPILOG, Json, Take, in_words, terminal_of
from axisync_cli.terminal import Terminal
from axisync_client import Client, InvalidArgument, Jog, Lease
from axisync_client.jog import Space

LOOK_S = 0.05
EXAMPLES = """Examples:

\b
  axisync jog kingkong --joint 0,0,5deg,0,0,0 --for 2s
  axisync jog kingkong --body 0,0,20mm
  axisync jog wukong --tool 0,0,-10mm --turn 0,0,5deg --for 1s

"""


def _option(flag: str, metavar: str, parse: Callable[[str], tuple[float, ...]], text: str) -> Any:
    return typer.Option(flag, metavar=metavar, parser=numbers(parse), help=text)


_tool = quantities.tool_velocity
Joint = Annotated[Numbers | None, _option("--joint", "V,...", quantities.joint_velocity, "Each axis, 0,0,5deg (a s).")]
Tool = Annotated[Numbers | None, _option("--tool", "X,Y,Z", _tool, "Along the tool's axes, 20,0,0mm (a s).")]
Base = Annotated[Numbers | None, _option("--base", "X,Y,Z", _tool, "Along the axes of the arm's base.")]
Body = Annotated[Numbers | None, _option("--body", "X,Y,Z", _tool, "Along the axes of the cell's frame O.")]
Turn = Annotated[
    Numbers | None,
    _option("--turn", "A,B,C", quantities.turn_velocity, "With --tool, --base or --body: about its axes, 0,0,5deg."),
]
For = Annotated[
    float | None,
    typer.Option("--for", metavar="TIME", parser=in_words(quantities.duration_s), help="2s; else until Ctrl-C."),
]


def add_to(app: typer.Typer) -> None:
    """Adds the command."""
    app.command(epilog=EXAMPLES + EPILOG)(jog)


def jog(
    context: typer.Context,
    group: Annotated[str, typer.Argument(metavar="GROUP", help="A group; with --joint also a compound.")],
    joint: Joint = None,
    tool: Tool = None,
    base: Base = None,
    body: Body = None,
    turn: Turn = None,
    seconds: For = None,
    take: Take = False,
    as_json: Json = False,
) -> None:
    """Move at a velocity until Ctrl-C, or for a time. The group stops when this command dies."""
    terminal = terminal_of(context, as_json, group)
    space, velocity = _asked({"joint": joint, "tool": tool, "base": base, "body": body}, turn)
    with terminal.connect() as client, terminal.lease(client, group, take) as lease:
        raise typer.Exit(_jog(terminal, client, lease, space, velocity, math.inf if seconds is None else seconds))


def _asked(given: dict[Space, Numbers | None], turn: Numbers | None) -> tuple[Space, tuple[float, ...]]:
    """The space, and the velocity in it."""
    said = {space: numbers.values for space, numbers in given.items() if numbers is not None}
    if len(said) != 1:
        raise InvalidArgument("how to jog?", "give one of --joint, --tool, --base and --body")
    ((space, velocity),) = said.items()
    velocity += () if turn is None else turn.values
    if not any(velocity):
        raise InvalidArgument("every velocity is zero")
    if turn is not None and space == "joint":
        raise InvalidArgument("--turn goes with --tool, --base or --body")
    return space, velocity


def _jog(
    terminal: Terminal, client: Client, lease: Lease, space: Space, velocity: tuple[float, ...], seconds: float
) -> int:
    """Until its time is over, it is interrupted, or there is no way on; the exit code."""
    interrupted = False
    with lease.jog(space=space, velocity=velocity) as motion:
        try:
            _show(terminal, motion)
            _wait(motion, seconds)
        except KeyboardInterrupt:
            interrupted = True
            terminal.say("interrupted: stopping")
    cell = client.config()
    names = [cell.group_names[i] for name in lease.groups for i in cell.members(name)]
    terminal.show(sentences.of_states(interrupts.stand(client, names, interrupts.STAND_TIMEOUT_S)))
    if interrupted:
        return EXIT_INTERRUPTED
    if motion.blocked is not None:
        raise motion.blocked
    return 0


def _wait(motion: Jog, seconds: float) -> None:
    end = time.monotonic() + seconds
    while motion.blocked is None and (left := end - time.monotonic()) > 0.0:
        motion.sleep(min(LOOK_S, left))


def _show(terminal: Terminal, motion: Jog) -> None:
    if motion.reply is not None:
        terminal.reply(motion.reply)
        terminal.show(sentences.of_jog(motion.reply))
