"""Judges a log: what was found in one pass, as a `Review`."""

import json
from collections.abc import Iterator
from datetime import UTC, datetime

from axisync_review.findings import Findings
from axisync_review.incidents import incidents
from axisync_review.log_file import being_written
from axisync_review.missing import missing
from axisync_review.models import (
    AxisReview,
    BusReview,
    EventReview,
    FileReview,
    GapReview,
    IncidentReview,
    LatenessReview,
    MoveReview,
    Problem,
    Review,
    Use,
)
from axisync_review.moves import arrival_problems, moves_of
from axisync_schemas.replies import Event
from axisync_service.canopen.budget import budget

PROBLEMS_SHOWN = 200
EVENTS_KEPT = 5000


def review_of(found: Findings) -> Review:
    """The report on what was gathered."""
    moves, gaps = moves_of(found), missing(found)
    problems = list(_problems(found, moves))
    return Review(
        good=not problems,
        verdict=_verdict(found, moves, problems),
        problems=tuple(problems[:PROBLEMS_SHOWN]),
        cell=found.run.cell.name,
        files=tuple(_files(found)),
        versions=_versions(found),
        began=_iso(found.begin_ns),
        duration_s=_duration(found),
        ticks=found.run.ticks,
        missing_ticks=found.run.missing + sum(gap.ticks for gap in gaps if gap.first < found.first_tick),
        duplicate_ticks=found.run.duplicates,
        sessions=found.run.sessions,
        period_s=found.run.cell.period,
        moves=tuple(moves),
        axes=tuple(_axis(found, index) for index in range(len(found.run.cell.axes))),
        lateness=_lateness(found),
        gaps=tuple(
            GapReview(first_tick=gap.first, last_tick=gap.last, t_s=found.t_s(gap.log_time_ns), why=gap.why)
            for gap in gaps
        ),
        incidents=tuple(
            IncidentReview.model_validate(
                {
                    "kind": i.kind,
                    "t_s": found.t_s(i.log_time_ns),
                    "tick": i.tick,
                    "group": i.group,
                    "message": i.message,
                }
            )
            for i in incidents(found)
        ),
        events=tuple(_events(found)),
        buses=tuple(_buses(found)),
        notes=tuple(_notes(found)),
    )


# --- problems -------------------------------------------------------------------------------------------------------


def _problems(found: Findings, moves: list[MoveReview]) -> Iterator[Problem]:
    run = found.run
    if not run.ticks:
        yield Problem(kind="empty", message="the log has no tick")
    for gap in missing(found):
        yield Problem(kind="gap", message=gap.text, tick=gap.first, t_s=found.t_s(gap.log_time_ns))
    if run.off_grid:
        yield Problem(kind="grid", message=f"{run.off_grid} times a tick's instant is off the grid of the tick before")
    yield from _excesses(found)
    most, allowed = found.lateness.skipped_commanded, run.cell.missed_ticks_max
    if most > allowed:
        text = f"{most} ticks were skipped in a row while drives were enabled, {allowed} are tolerated"
        yield Problem(kind="skipped", message=text)
    yield from arrival_problems(found, moves)
    for file in run.files:
        for damage in file.dropped:
            text = f"{file.path.name}: byte {damage.offset:,}: {damage.text}; what was in it is lost"
            yield Problem(kind="damage", message=text)


def _excesses(found: Findings) -> Iterator[Problem]:
    for excess in found.limits.excesses:
        name = found.run.cell.axes[excess.axis].name
        text = f"{name}: {excess.what} is {excess.value:.6g}, allowed {excess.allowed:.6g}, at tick {excess.tick}"
        yield Problem(kind="limit", message=text, axis=name, tick=excess.tick, t_s=found.t_s(excess.log_time_ns))


def _verdict(found: Findings, moves: list[MoveReview], problems: list[Problem]) -> str:
    if problems:
        rest = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        return f"NOT GOOD: {problems[0].message}{rest}"
    halts = _counted([one.kind for one in incidents(found)])
    also = "".join(f", {count} {_plural(kind, count)}" for kind, count in halts.items())
    if not moves:
        return f"good: nothing moved, no tick is missing{also}"
    axes = [_axis(found, index) for index in range(len(found.run.cell.axes))]
    worst = max(use.share for axis in axes for use in _uses(axis))
    ended = ", ".join(f"{count} {status}" for status, count in _counted([move.status for move in moves]).items())
    return f"good: limits kept (at most {_percent(worst)} of one), no tick missing, moves: {ended}{also}"


def _uses(axis: AxisReview) -> tuple[Use, ...]:
    return axis.velocity, axis.acceleration, axis.jerk, axis.stop_acceleration, axis.stop_jerk


def _counted(words: list[str]) -> dict[str, int]:
    return {word: words.count(word) for word in dict.fromkeys(words)}


def _plural(kind: str, count: int) -> str:
    word = {"process": "process that died"}.get(kind, kind)
    return word if count == 1 else {"process": "processes that died"}.get(kind, f"{kind}s")


def _percent(share: float) -> str:
    """Never 100 % for what is below, but for rounding."""
    return f"{100 * share:.1f} %"


# --- parts ----------------------------------------------------------------------------------------------------------


def _duration(found: Findings) -> float:
    if not found.run.ticks:
        return found.t_s(found.end_ns) if found.end_ns else 0.0
    return found.t_s(found.end_ns) + found.run.cell.period


def _files(found: Findings) -> Iterator[FileReview]:
    for file in found.run.files:
        damage = None if file.damage is None else f"cut at byte {file.damage.offset:,}: {file.damage.text}"
        yield FileReview(path=str(file.path), bytes=file.size, complete=file.damage is None, damage=damage)


def _versions(found: Findings) -> dict[str, str]:
    try:
        versions = json.loads(found.run.heading.versions)
    except ValueError:
        return {}
    return {str(name): str(version) for name, version in versions.items()} if isinstance(versions, dict) else {}


def _iso(ns: int) -> str | None:
    try:
        return datetime.fromtimestamp(ns / 1e9, UTC).isoformat(timespec="milliseconds") if ns else None
    except (OverflowError, ValueError, OSError):
        return None


def _axis(found: Findings, index: int) -> AxisReview:
    axis, use, following = found.run.cell.axes[index], found.limits, found.following
    peak = float(following.greatest[index])

    def moving(order: int) -> Use:
        value = float(use.moving[order, index])
        return Use(peak=value, share=value / float(use.limits[order, index]))

    def stopping(order: int) -> Use:
        value = float(use.stopping[order, index])
        return Use(peak=value, share=value / float(use.stop_limits[order, index]))

    return AxisReview(
        axis=axis.name,
        velocity=moving(0) if use.moving[0, index] >= use.stopping[0, index] else stopping(0),
        acceleration=moving(1),
        jerk=moving(2),
        stop_acceleration=stopping(1),
        stop_jerk=stopping(2),
        following_error_peak=peak,
        following_error_rms=float(following.rms[index]),
        following_error_share=peak / axis.drive.following_error_max,
        following_error_tick=int(following.tick[index]),
    )


def _lateness(found: Findings) -> LatenessReview:
    lateness = found.lateness
    edges, counts = lateness.bars()
    return LatenessReview(
        ticks=int(lateness.counts.sum()),
        p50_us=lateness.percentile_us(50),
        p99_us=lateness.percentile_us(99),
        p999_us=lateness.percentile_us(99.9),
        max_us=lateness.greatest_ns / 1e3,
        max_tick=lateness.greatest_tick,
        skipped=lateness.skipped,
        skipped_in_a_row=lateness.skipped_in_a_row,
        edges_us=tuple(edges),
        counts=tuple(counts),
    )


def _events(found: Findings) -> Iterator[EventReview]:
    for told in found.story.events[:EVENTS_KEPT]:
        event = told.what
        if isinstance(event, Event):
            yield EventReview(
                t_s=found.t_s(told.log_time_ns), kind=event.kind, source=event.source, severity=event.severity,
                group=event.group, message=event.message,
            )  # fmt: skip


def _buses(found: Findings) -> Iterator[BusReview]:
    cell = found.run.cell
    logged = _logged_loads(found)
    for bus in cell.buses:
        yield BusReview(bus=bus.name, planned_load=budget(cell, bus).load, logged_load=logged.get(bus.name))


def _logged_loads(found: Findings) -> dict[str, float]:
    """The highest load of each bus that an event carries in `details.buses`, where any does."""
    loads: dict[str, float] = {}
    for told in found.story.events:
        buses = told.what.details.get("buses") if isinstance(told.what, Event) else None
        for name, load in buses.items() if isinstance(buses, dict) else ():
            if isinstance(load, int | float):
                loads[str(name)] = max(loads.get(str(name), 0.0), float(load))
    return loads


def _notes(found: Findings) -> Iterator[str]:
    """What a reader should know, though it is no fault."""
    lateness = found.lateness
    if lateness.skipped:
        most = f"at most {lateness.skipped_in_a_row} in a row, {lateness.skipped_commanded} while drives were enabled"
        yield f"{lateness.skipped:,} ticks were skipped, {most} ({found.run.cell.missed_ticks_max} are tolerated)"
    if found.run.sessions > 1:
        yield f"the controller was started {found.run.sessions} times"
    if found.run.duplicates:
        yield f"{found.run.duplicates} ticks are in two files; each is counted once"
    for file in found.run.files:
        if file.damage is not None:
            state = "is still being written" if being_written(file.path) else "was not closed"
            yield f"{file.path.name} {state}: it is read up to byte {file.damage.offset:,} of {file.size:,}"
    for topic, count in found.story.unread.items():
        yield f"{count} messages of {topic} are of another schema version and were left out"
