"""review, why, replay, recover, export, diff: what a log tells. They need no daemon."""

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from axisync_cli.options import Json, terminal_of
from axisync_cli.terminal import Terminal
from axisync_client import AxisyncError, ErrorCode

if TYPE_CHECKING:
    from rich.console import RenderableType

    from axisync_review.pieces import Progress as Report
    from axisync_schemas.base import Strict

Files = Annotated[list[Path], typer.Argument(metavar="FILE...", help="Logs of one cell.", show_default=False)]
File = Annotated[Path, typer.Argument(metavar="FILE", help="A log.", show_default=False)]
Html = Annotated[
    Path | None, typer.Option("--html", metavar="FILE", help="Also write a report with curves, one file for a browser.")
]
Out = Annotated[Path | None, typer.Option("-o", "--out", metavar="FILE", help="Where to; else beside the log.")]
Parquet = Annotated[bool, typer.Option("--parquet", help="Apache Parquet.")]
Csv = Annotated[bool, typer.Option("--csv", help="Comma-separated values.")]
Replan = Annotated[bool, typer.Option("--replan", help="Also plan every logged request again, and compare.")]
NEEDED = ("mcap", "zstandard", "lz4")


class ReviewMissing(AxisyncError):
    """The extra `review` is not installed."""

    code = ErrorCode.UNAVAILABLE


def add_to(app: typer.Typer) -> None:
    """Adds the commands, in the order in which help shows them."""
    for command in (review, why, replay, recover, export, diff):
        app.command()(command)


def review(context: typer.Context, files: Files, html: Html = None, as_json: Json = False) -> None:
    """Judge logs; exit status 1 where something is wrong.

    Moves, limits, following error, lateness, gaps, stops.
    """
    terminal = _ready(context, as_json)
    from axisync_review import findings, html_report
    from axisync_review.review import review_of
    from axisync_review.text import parts

    with _progress(terminal, "reading") as report:
        found = findings.gather(files, curves=html is not None, progress=report)
    judged = review_of(found)
    if html is not None:
        html_report.save(judged, found, html)
        terminal.show(f"report in {html}")
    terminal.reply(judged)
    _show(terminal, parts(judged))
    _exit(judged.good)


def why(context: typer.Context, files: Files, as_json: Json = False) -> None:
    """Tell for each stop, fault, refusal or gap what led to it."""
    terminal = _ready(context, as_json)
    from axisync_review import findings
    from axisync_review import why as reasons

    with _progress(terminal, "reading") as report:
        found = findings.gather(files, progress=report)
    incidents = reasons.why(found)
    _list(terminal, incidents)
    for incident in incidents:
        terminal.show("\n".join(reasons.lines(incident)))
    if not incidents:
        missing = "no tick is missing" if found.run.ticks else "but the log has no tick"
        terminal.show(f"nothing was stopped, nothing was refused, {missing}")


def replay(context: typer.Context, files: Files, replan: Replan = False, as_json: Json = False) -> None:
    """Compute every setpoint again from the logged plans."""
    terminal = _ready(context, as_json)
    from axisync_review import replan as planner
    from axisync_review import replay as player
    from axisync_review.tables import of_replans, of_replay

    with _progress(terminal, "replaying") as report:
        played = player.replay(files, report)
    plans = planner.replan_all(files) if replan else []
    if as_json:
        text = {**played.model_dump(mode="json"), "replanned": [plan.model_dump(mode="json") for plan in plans]}
        terminal.json_line(json.dumps(text))
    _show(terminal, [*of_replans(plans), *of_replay(played)])
    _exit(played.same and all(plan.same for plan in plans))


def recover(context: typer.Context, file: File, out: Out = None, as_json: Json = False) -> None:
    """Make a valid log of one that was cut; say what was lost."""
    terminal = _ready(context, as_json)
    from axisync_review import recover as recovery
    from axisync_review.tables import of_recovery

    target = out if out is not None else file.with_name(f"{file.stem}_recovered.mcap")
    with _progress(terminal, "copying") as report:
        done = recovery.recover(file, target, report)
    terminal.reply(done)
    _show(terminal, of_recovery(done))


def export(
    context: typer.Context,
    files: Files,
    parquet: Parquet = False,
    csv: Csv = False,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Write every tick as a row of a table; units in the names."""
    if parquet == csv:
        raise typer.BadParameter("one of --parquet and --csv is needed", param_hint="--parquet/--csv")
    terminal = _ready(context, as_json)
    from axisync_review import export as table

    if parquet:
        table.require_pyarrow()
    target = out if out is not None else files[0].with_suffix(".parquet" if parquet else ".csv")
    with _progress(terminal, "writing") as report:
        rows = table.export(files, target, table.ParquetSink if parquet else table.CsvSink, report)
    if as_json:
        terminal.json_line(json.dumps({"path": str(target), "rows": rows}))
    terminal.show(f"{rows:,} ticks in {target}")


def diff(
    context: typer.Context,
    a: Annotated[Path, typer.Argument(metavar="A", help="Log of one run.", show_default=False)],
    b: Annotated[Path, typer.Argument(metavar="B", help="Log of another run.", show_default=False)],
    as_json: Json = False,
) -> None:
    """Compare two runs of one program.

    Exit status 1 where moves, setpoints or results differ.
    """
    terminal = _ready(context, as_json)
    from axisync_review import diff as comparing
    from axisync_review.tables import of_diff

    with _progress(terminal, "reading") as report:
        found = comparing.diff([a], [b], report)
    terminal.reply(found)
    _show(terminal, of_diff(found))
    _exit(found.same)


# --- what they share ------------------------------------------------------------------------------------------------


def _ready(context: typer.Context, as_json: bool) -> Terminal:
    """
    Raises:
        ReviewMissing: a package of the extra is not there.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        fix = "install the extra `review`, for example `pip install 'axisync[review]'`"
        raise ReviewMissing(f"reading logs needs {', '.join(missing)}, which is not installed", fix)
    return terminal_of(context, as_json)


def _show(terminal: Terminal, parts: "Iterable[RenderableType]") -> None:
    """Tables laid out, sentences never wrapped."""
    for part in parts:
        terminal.show(part)


def _list(terminal: Terminal, items: "Iterable[Strict]") -> None:
    if terminal.as_json:
        terminal.json_line(json.dumps([item.model_dump(mode="json") for item in items]))


def _exit(good: bool) -> None:
    if not good:
        raise typer.Exit(1)


@contextmanager
def _progress(terminal: Terminal, verb: str) -> "Iterator[Report | None]":
    """A bar on stderr, where somebody looks; gone at the end."""
    if not terminal.err.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    with Progress(*columns, TimeRemainingColumn(), console=terminal.err, transient=True) as bar:
        task = bar.add_task(verb, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
