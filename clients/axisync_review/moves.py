"""The moves of a log: what was asked, what was planned, what was played, and how it ended."""

from collections.abc import Iterator

import numpy as np

from axisync_review.changes import Played
from axisync_review.findings import Findings
from axisync_review.models import MoveReview, Problem
from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.events import EventKind
from axisync_schemas.log_models import PlanLog
from axisync_schemas.replies import Event
from axisync_schemas.topics import LOG_PLANS


def moves_of(found: Findings) -> list[MoveReview]:
    """All moves that were accepted or played, in order of time."""
    played = {plan_id: list(spans) for plan_id, spans in _by_plan(found).items()}
    endings = {int(event.details["plan_id"]): event for _, event in _endings(found)}
    ids = dict.fromkeys([*played, *found.story.plans])
    reviews = [_review(found, plan_id, played.get(plan_id, []), endings.get(plan_id)) for plan_id in ids]
    return sorted(reviews, key=lambda move: move.begin_s)


def _by_plan(found: Findings) -> dict[int, list[Played]]:
    plans: dict[int, list[Played]] = {}
    for one in found.changes.played:
        plans.setdefault(one.plan_id, []).append(one)
    return plans


def _endings(found: Findings) -> Iterator[tuple[int, Event]]:
    for time, event in found.story.of_kind(EventKind.MOVE_ENDED):
        if isinstance(event.details.get("plan_id"), int):
            yield time, event


def _review(found: Findings, plan_id: int, spans: list[Played], ending: Event | None) -> MoveReview:
    plan = found.story.plans.get(plan_id)
    status, reason = _ended_as(found, plan, spans, ending)
    begin_ns = min((span.begin_ns for span in spans), default=found.story.plan_times.get(plan_id, found.begin_ns))
    end_ns = max((span.end_ns for span in spans), default=None)
    names = [found.run.cell.group_names[span.group] for span in spans]
    period_ns = found.run.cell.period_ns
    return MoveReview(
        move_id=plan.move_id if plan else None,
        plan_id=plan_id,
        group=plan.group if plan else "+".join(dict.fromkeys(names)),
        kind=str(plan.move.get("kind", "?")) if plan else "?",
        user=plan.user if plan else None,
        status=status,
        reason=reason,
        begin_s=found.t_s(begin_ns),
        planned_s=plan.reply.duration_s if plan and plan.reply else None,
        played_s=None if end_ns is None else (end_ns - begin_ns + period_ns) / 1e9,
        first_tick=min((span.first_tick for span in spans), default=None),
        last_tick=max((span.last_tick for span in spans), default=None),
        limiting=plan.reply.limiting if plan and plan.reply else None,
    )


def _ended_as(
    found: Findings, plan: PlanLog | None, spans: list[Played], ending: Event | None
) -> tuple[str, str | None]:
    """As the controller said; where the log has lost that, as the ticks show."""
    if ending is not None:
        reason = ending.details.get("reason")
        return str(ending.details.get("status")), reason if isinstance(reason, str) else None
    if any(span.end_position is None for span in spans):
        state = _last_state(found, spans[0].group)
        return (MoveStatus.HELD.value if state == GroupState.HELD else MoveStatus.EXECUTING.value), None
    if not spans:
        return "not played", None
    whole = plan is not None and plan.knots and spans[0].path_s >= plan.knots[-1] - found.run.cell.period
    return (MoveStatus.SUCCEEDED if whole else MoveStatus.STOPPED).value, None


def _last_state(found: Findings, group: int) -> int | None:
    changes = [change.after for change in found.changes.groups if change.index == group]
    return changes[-1] if changes else None


def arrival_problems(found: Findings, moves: list[MoveReview]) -> list[Problem]:
    """A move that succeeded ends where its plan ends, to the bit, its groups on the same tick; its plan is logged."""
    problems = []
    spans = _by_plan(found)
    for move in moves:
        played, plan = spans.get(move.plan_id, []), found.story.plans.get(move.plan_id)
        if not played:
            continue
        if plan is None or plan.missing:
            why = plan.missing if plan else _no_plan(found)
            problems.append(Problem(kind="plan", message=f"the plan of move {_name(move)} is missing: {why}"))
            continue
        if len({(span.first_tick, span.last_tick) for span in played}) > 1:
            problems.append(
                Problem(
                    kind="arrival", message=f"move {_name(move)}: its groups do not begin and end on the same ticks"
                )
            )
        if move.status == MoveStatus.SUCCEEDED and plan.end:
            problems += _misses(found, move, plan, played)
    return problems


def _misses(found: Findings, move: MoveReview, plan: PlanLog, played: list[Played]) -> Iterator[Problem]:
    ends = dict(zip(plan.axes, plan.end, strict=False))
    for span in played:
        if span.end_position is None:
            continue
        axes = found.run.cell.axis_indices(found.run.cell.group_names[span.group])
        wanted = np.array([ends.get(axis, np.nan) for axis in axes])
        for index in np.flatnonzero(span.end_position != wanted):
            axis = found.run.cell.axes[axes[index]].name
            text = f"move {_name(move)}: {axis} ends at {span.end_position[index]:.9g} rad, planned {wanted[index]:.9g}"
            yield Problem(kind="arrival", message=text, axis=axis, tick=span.last_tick + 1, t_s=found.t_s(span.end_ns))


def _no_plan(found: Findings) -> str:
    unread = LOG_PLANS in found.story.unread
    return "what the log has of plans is of another schema version" if unread else "the log does not have it"


def _name(move: MoveReview) -> str:
    return move.move_id or str(move.plan_id)
