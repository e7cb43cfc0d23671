"""move and plan."""

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from axisync_cli import interrupts, plan_plot, sentences
from axisync_cli.options import (
    EPILOG,
    Duration,
    Group,
    Joint,
    Json,
    Minimise,
    Plot,
    PulseShape,
    Relative,
    Speed,
    terminal_of,
)
from axisync_cli.plan_curves import curves
from axisync_cli.plan_table import plan_table, setpoints
from axisync_cli.quantities import Minimise as MinimiseChoice
from axisync_cli.quantities import Pulse
from axisync_cli.terminal import Terminal
from axisync_client import Move, MoveStatus
from axisync_schemas.replies import MoveReport


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (plan, move):
        app.command(epilog=EPILOG)(command)


def move(
    context: typer.Context,
    group: Group,
    joint: Joint,
    relative: Relative = False,
    minimise: Minimise = MinimiseChoice.ACCELERATION,
    duration: Duration = None,
    pulse: PulseShape = Pulse.CONSTANT,
    speed: Speed = 1.0,
    as_json: Json = False,
) -> None:
    """Move a group and wait until it has arrived. Ctrl-C stops it; a second Ctrl-C leaves at once."""
    terminal = terminal_of(context, as_json, group)
    with terminal.connect() as client, client.lease(group) as lease:
        try:
            accepted = lease.move_joint(
                joint.values,
                relative=relative,
                minimise=minimise.value,
                duration_s=duration,
                pulse=pulse.value,
                speed_scale=speed,
            )
            report = _follow(terminal, accepted)
        except KeyboardInterrupt:
            # It may be on its way even where no answer has come yet.
            raise typer.Exit(interrupts.stop_and_wait(terminal, client, group)) from None
    raise typer.Exit(_ended(terminal, report))


def plan(
    context: typer.Context,
    group: Group,
    joint: Joint,
    relative: Relative = False,
    minimise: Minimise = MinimiseChoice.ACCELERATION,
    duration: Duration = None,
    pulse: PulseShape = Pulse.CONSTANT,
    speed: Speed = 1.0,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Show what a move would be, without moving."""
    terminal = terminal_of(context, as_json, group)
    if plot is not None:
        plan_plot.require()
    with terminal.connect() as client:
        reply = client.plan_joint(
            group,
            joint.values,
            relative=relative,
            minimise=minimise.value,
            duration_s=duration,
            pulse=pulse.value,
            speed_scale=speed,
        )
        start = setpoints(client.state(), client.config(), group) if plot is not None or not as_json else ()
    terminal.reply(reply)
    if not as_json:
        terminal.show(plan_table(reply, start, joint.values, relative, pulse.value))
    if plot is not None:
        plan_plot.save(curves(reply, start, pulse.value), plot)
        terminal.show(f"drawn in {plot}")


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
            bar.update(task, completed=report.progress)
    return report


def _ended(terminal: Terminal, report: MoveReport) -> int:
    arrived = report.status is MoveStatus.SUCCEEDED
    if arrived:
        terminal.show(sentences.of_ending(report))
    else:
        terminal.say(sentences.of_ending(report))
    return 0 if arrived else 1
