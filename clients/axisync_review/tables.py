"""Replays and comparisons for people, on a terminal."""

from collections.abc import Iterable, Iterator

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from axisync_review.diff import Diff, MoveDiff
from axisync_review.recover import Recovery
from axisync_review.replan import Replanned
from axisync_review.replay import Replay


def of_replay(replay: Replay) -> Iterator[RenderableType]:
    """One line for what was the same, one for what was not."""
    yield from (Text(f"note: {note}") for note in replay.notes)
    at = replay.difference
    if at is None:
        text = f"the same to the bit: {replay.ticks:,} ticks, {replay.plans} plans played again"
        yield Text(text if replay.ticks else "the log has no tick: there is nothing to replay", style="bold green")
    else:
        text = f"DIFFERENT from tick {at.tick} on: {at.what} is {at.logged} in the log and {at.replayed} in the replay"
        yield Text(text, style="bold red")


def of_replans(plans: Iterable[Replanned]) -> Iterator[RenderableType]:
    """A line a plan."""
    yield from map(_replan, plans)


def _replan(plan: Replanned) -> Text:
    name = f"{plan.move_id or 'a plan'} of {plan.group}"
    if plan.error is None:
        return Text(f"{name}: cannot be planned again: {plan.reason}", style="red")
    style = "" if plan.same else "bold red"
    return Text(f"{name}: planned again, at most {plan.error:.3g} rad away", style=style)


def of_recovery(recovery: Recovery) -> Iterator[RenderableType]:
    """What the new file has, and what was lost."""
    last = "" if recovery.last_tick is None else f", the last is tick {recovery.last_tick}"
    yield Text(f"{recovery.path}: {recovery.ticks:,} ticks{last}, {recovery.messages:,} messages")
    if recovery.was_whole:
        yield Text("the log was whole: nothing was lost")
    yield from (Text(f"lost: {text}", style="yellow") for text in recovery.lost)


def of_diff(diff: Diff) -> Iterator[RenderableType]:
    """Moves, drives, timing, and the sentence."""
    if diff.moves:
        yield _moves(diff.moves)
    table = _table("following error, mrad", "axis", "rms A", "rms B", "peak A", "peak B")
    for axis in diff.axes:
        values = (axis.rms_a, axis.rms_b, axis.peak_a, axis.peak_b)
        table.add_row(axis.axis, *(f"{1e3 * value:.3f}" for value in values))
    yield table
    t = diff.timing
    yield Text(
        f"lateness A / B, us: p50 {t.p50_a:.3g} / {t.p50_b:.3g}, p99 {t.p99_a:.3g} / {t.p99_b:.3g}, "
        f"max {t.max_a:.3g} / {t.max_b:.3g}; skipped ticks {t.skipped_a} / {t.skipped_b}",
    )  # fmt: skip
    yield Text(diff.summary, style="bold green" if diff.same else "bold yellow")


def _moves(moves: tuple[MoveDiff, ...]) -> Table:
    table = _table(
        "moves", "group", "move", "result A", "result B", "planned A, s", "planned B, s", "plan", "setpoints"
    )
    for move in moves:
        plan = "the same" if move.same_plan else "missing" if move.plan_error is None else f"{move.plan_error:.3g} rad"
        table.add_row(
            move.group, str(move.number), move.status_a or "-", move.status_b or "-", _seconds(move.planned_a_s),
            _seconds(move.planned_b_s), plan, "the same" if move.same_setpoints else "different",
        )  # fmt: skip
    return table


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0))
    for heading in headings:
        table.add_column(heading, justify="right" if "," in heading or heading[-2:] in (" A", " B") else "left")
    return table
