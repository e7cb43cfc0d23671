"""plan, move and run."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from axisync_cli import interrupts, plan_plot, sentences
from axisync_cli.move_options import Asked, spread
from axisync_cli.options import EPILOG, Json, Plot, Speed, Take, terminal_of
from axisync_cli.plan_curves import curves
from axisync_cli.plan_table import plan_table, summary
from axisync_cli.scalars import scalars_of
from axisync_cli.terminal import Terminal
from axisync_client import Move, MoveStatus, Program
from axisync_client.program import load
from axisync_schemas.moves import SequenceMove
from axisync_schemas.replies import MoveReport

EXAMPLES = """Examples:

\b
  {0} kingkong --joint 0,-150,60,-45,-45,45deg
  {0} kingkong --linear 0,0,50mm --relative --frame body
  {0} both --linear kingkong=0,0,50mm --linear wukong=0,0,50mm --relative
  {0} --file tool_change.toml --speed 50%

"""
ProgramFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="A program, FILE.toml, or a move as on the wire, FILE.json.")
]


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (plan, move):
        examples = EXAMPLES.format(f"axisync {command.__name__}")
        app.command(epilog=examples + EPILOG)(spread(command))
    app.command(epilog=EPILOG)(run)


def move(context: typer.Context, asked: Asked, speed: Speed = 1.0, take: Take = False, as_json: Json = False) -> None:
    """Move a group and wait until it has arrived. Ctrl-C stops it; a second Ctrl-C leaves at once."""
    terminal = terminal_of(context, as_json, asked.group)
    _play(terminal, asked.program(), speed, take)


def run(
    context: typer.Context, file: ProgramFile, speed: Speed = 1.0, take: Take = False, as_json: Json = False
) -> None:
    """Play a program file and wait until it has ended. Ctrl-C stops it; a second Ctrl-C leaves at once."""
    terminal = terminal_of(context, as_json)
    _play(terminal, load(file), speed, take)


def plan(context: typer.Context, asked: Asked, speed: Speed = 1.0, plot: Plot = None, as_json: Json = False) -> None:
    """Show what a move would be, without moving."""
    terminal = terminal_of(context, as_json, asked.group)
    program = asked.program()
    terminal.group = program.group
    if plot is not None:
        plan_plot.require()
        if isinstance(program.move, SequenceMove):
            plan_plot.refuse_steps()
    with terminal.connect() as client:
        reply = client.plan_program(program, speed_scale=speed)
        shown = plot is not None or not as_json
        scalars = scalars_of(reply, client.state(), client.config()) if shown else ()
    terminal.reply(reply)
    pulse = "constant" if isinstance(program.move, SequenceMove) else program.move.pulse
    terminal.show(plan_table(reply, scalars, pulse))
    terminal.show(summary(reply, scalars))
    if plot is not None:
        plan_plot.save(curves(reply, scalars, pulse), plot)
        terminal.show(f"drawn in {plot}")


def _play(terminal: Terminal, program: Program, speed: float, take: bool) -> None:
    """Moves and waits; leaves by typer.Exit."""
    terminal.group = program.group
    with terminal.connect() as client, terminal.lease(client, program.group, take) as lease:
        try:
            report = _follow(terminal, lease.run_program(program, speed_scale=speed))
        except KeyboardInterrupt:
            # It may be on its way even where no answer has come yet.
            raise typer.Exit(interrupts.stop_and_wait(terminal, client, program.group)) from None
    raise typer.Exit(_ended(terminal, report))


def _follow(terminal: Terminal, move: Move) -> MoveReport:
    """Prints what was accepted, then shows a bar until the end."""
    terminal.reply(move.reply)
    terminal.show(sentences.of_acceptance(move.reply))
    for warning in move.reply.warnings:
        terminal.show(f"warning: {warning}")
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    hidden = terminal.as_json or not terminal.err.is_terminal
    with Progress(*columns, TimeRemainingColumn(), console=terminal.err, transient=True, disable=hidden) as bar:
        task = bar.add_task(move.group, total=1.0)
        for report in move.updates():
            words = sentences.of_progress(move.reply, report.progress)
            bar.update(task, completed=report.progress, description=words)
    return report


def _ended(terminal: Terminal, report: MoveReport) -> int:
    arrived = report.status is MoveStatus.SUCCEEDED
    if arrived:
        terminal.show(sentences.of_ending(report))
    else:
        terminal.say(sentences.of_ending(report))
    return 0 if arrived else 1
