"""A review for people, on a terminal."""

from collections.abc import Iterator

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from axisync_review.models import AxisReview, EventReview, LatenessReview, MoveReview, Review, Use

EVENTS_SHOWN = 12
PROBLEMS_SHOWN = 20
INCIDENTS_SHOWN = 20
BAR = 30
_SEVERITY = {"warning": "yellow", "error": "bold red"}
_STATUS = {"succeeded": "green", "stopped": "yellow", "held": "yellow", "failed": "bold red"}


def parts(review: Review) -> Iterator[RenderableType]:
    """All of it, to be printed one after the other; the verdict is last, where it is seen."""
    yield from _heading(review)
    if review.moves:
        yield _moves(review.moves)
    if review.ticks:
        yield _axes(review.axes)
        yield from _lateness(review.lateness)
    if review.buses:
        yield Text(f"buses: {', '.join(_buses(review))}")
    yield from _incidents(review)
    yield from _events(review)
    yield from (Text(f"note: {note}") for note in review.notes)
    for problem in review.problems[:PROBLEMS_SHOWN]:
        at = "" if problem.t_s is None else f"{problem.t_s:.3f} s: "
        yield Text(f"problem: {at}{problem.message}", style="red")
    if len(review.problems) > PROBLEMS_SHOWN:
        yield Text(f"and {len(review.problems) - PROBLEMS_SHOWN} more problems", style="red")
    yield verdict(review)


def verdict(review: Review) -> Text:
    """The one line."""
    return Text(review.verdict, style="bold green" if review.good else "bold red")


def _heading(review: Review) -> Iterator[Text]:
    names = ", ".join(file.path for file in review.files)
    version = review.versions.get("axisync", "an unknown version")
    yield Text(f"{names}: cell {review.cell}, written by axisync {version}")
    began = review.began.replace("T", " ").replace("+00:00", " UTC") if review.began else "at an unknown time"
    yield Text(
        f"began {began}, {span(review.duration_s)}, {review.ticks:,} ticks of {review.period_s * 1e3:g} ms, "
        f"{review.missing_ticks or 'none'} missing, {review.lateness.skipped or 'none'} skipped"
    )


def span(seconds: float) -> str:
    """`97.306 s`, `12 min 3 s`, `1 h 0 min 3 s`."""
    if seconds < 180:
        return f"{seconds:.3f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min {rest} s" if hours else f"{minutes} min {rest} s"


def _moves(moves: tuple[MoveReview, ...]) -> Table:
    limited = any(move.limiting for move in moves)
    headings = ["move", "group", "kind", "at, s", "plan, s", "took, s", *(["limited by"] if limited else []), "result"]
    table = _table("moves", *headings)
    shown = moves if len(moves) <= 40 else (*moves[:20], *moves[-20:])
    for number, move in enumerate(shown):
        if len(shown) < len(moves) and number == 20:
            table.add_row(f"... {len(moves) - 40} more")
        result = Text(move.status + (f": {move.reason}" if move.reason else ""), style=_STATUS.get(move.status, ""))
        table.add_row(
            move.move_id or str(move.plan_id), move.group, move.kind, f"{move.begin_s:.3f}", _seconds(move.planned_s),
            _seconds(move.played_s), *([move.limiting or ""] if limited else []), result,
        )  # fmt: skip
    return table


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _axes(axes: tuple[AxisReview, ...]) -> Table:
    table = _table("limits used, % (stop: of the stop limits)", "axis", "v", "a", "j", "stop a", "stop j",
                   "following error, mrad: rms", "peak", "% of window")  # fmt: skip
    for axis in axes:
        uses = (axis.velocity, axis.acceleration, axis.jerk, axis.stop_acceleration, axis.stop_jerk)
        error = f"{axis.following_error_rms * 1e3:.3f}", f"{axis.following_error_peak * 1e3:.3f}"
        share = f"{100 * axis.following_error_share:.1f}"
        table.add_row(axis.axis, *map(_share, uses), *error, share)
    return table


def _share(use: Use) -> Text:
    over = use.share > 1.0 + 1e-5
    return Text("-" if not use.peak else f"{100 * use.share:.1f}", style="bold red" if over else "")


def _lateness(late: LatenessReview) -> Iterator[RenderableType]:
    yield Text(
        f"lateness of {late.ticks:,} ticks, us: p50 {late.p50_us:.3g}, p99 {late.p99_us:.3g}, "
        f"p99.9 {late.p999_us:.3g}, max {late.max_us:,.3g} (tick {late.max_tick}); "
        f"{late.skipped} ticks skipped, at most {late.skipped_in_a_row} in a row"
    )
    if not late.counts:
        return
    table = Table(box=None, show_header=False, padding=(0, 1))
    bars = list(_coarser(late))
    most = max(count for _, count in bars)
    for edge, count in bars:
        table.add_row(f"from {edge:,.3g} us", f"{count:,}", "█" * max(1, round(BAR * count / most)) if count else "")
    yield table


def _coarser(late: LatenessReview) -> Iterator[tuple[float, int]]:
    """Two bars a decade are enough on a terminal."""
    found: dict[float, int] = {}
    edges = [0.0, *(10.0 ** (n / 2 - 1) for n in range(20))]
    for edge, count in zip(late.edges_us, late.counts, strict=True):
        lower = max(e for e in edges if e <= edge * (1 + 1e-9))
        found[lower] = found.get(lower, 0) + count
    yield from found.items()


def _buses(review: Review) -> Iterator[str]:
    for bus in review.buses:
        planned = "" if bus.planned_load is None else f"{bus.planned_load:.0%} by its cell file, at worst"
        logged = "" if bus.logged_load is None else f"{bus.logged_load:.0%} at most as logged"
        yield f"{bus.bus} {'; '.join(filter(None, (logged, planned)))}"


def _incidents(review: Review) -> Iterator[RenderableType]:
    if not review.incidents:
        return
    table = _table("stops, faults and refusals (`axisync why` has the evidence)", "at, s", "tick", "what")
    for one in review.incidents[:INCIDENTS_SHOWN]:
        table.add_row(f"{one.t_s:.3f}", "" if one.tick is None else str(one.tick), Text(one.message))
    if len(review.incidents) > INCIDENTS_SHOWN:
        table.add_row("", "", f"and {len(review.incidents) - INCIDENTS_SHOWN} more")
    yield table


def _events(review: Review) -> Iterator[RenderableType]:
    grave = [event for event in review.events if event.severity != "info"]
    counts: dict[str, int] = {}
    for event in review.events:
        counts[event.kind] = counts.get(event.kind, 0) + 1
    if counts:
        yield Text("events: " + ", ".join(f"{count} {kind}" for kind, count in counts.items()))
    firsts: dict[tuple[str, str | None], EventReview] = {}
    for event in grave:
        firsts.setdefault((event.kind, event.group), event)
    shown = list(firsts.values())[:EVENTS_SHOWN]
    for event in shown:
        text = f"  {event.t_s:.3f} s {event.source} {event.kind}: {event.message}"
        yield Text(text, style=_SEVERITY.get(event.severity, ""))
    if len(grave) > len(shown):
        yield Text(f"  and {len(grave) - len(shown)} more warnings and errors, most of these kinds")


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0))
    left = {"move", "group", "kind", "limited by", "result", "axis", "what"}
    for heading in headings:
        table.add_column(
            heading,
            justify="left" if heading in left else "right",
            overflow="fold",
            no_wrap=heading in ("group", "kind"),  # where it is narrow, a move's long id folds before anything else
        )
    return table
