"""Stops, faults, refusals and dead processes, each with the chain of evidence that the log has for it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from axisync_review.changes import Change, Played, drive_state, group_state
from axisync_review.findings import Findings
from axisync_schemas.enumerations import GroupState
from axisync_schemas.events import EventKind
from axisync_schemas.log_models import RequestLog
from axisync_schemas.replies import Event

BEFORE_NS = 1_000_000_000
"""Causes that were noticed are said within a second."""
AFTER_NS = 500_000_000
SAME_NS = 50_000_000
"""One cause is often said by several processes within this time."""
CAUSES = (
    EventKind.DRIVE_FAULT, EventKind.DRIVE_LOST, EventKind.EMERGENCY, EventKind.LEASE_LAPSED, EventKind.LEASE_TAKEN,
    EventKind.LEASE_RELEASED, EventKind.FRONT_LOST, EventKind.PROCESS_DIED, EventKind.TICKS_SKIPPED,
    EventKind.TICKS_OVERRUN, EventKind.CYCLE_FAILED, EventKind.BUS_FAILED, EventKind.SERVICE_STOPPING,
    EventKind.RECORDER_FAILING,
)  # fmt: skip
"""Kinds of events that explain a stop."""
LEASE_WORDS = "lease"


@dataclass(frozen=True, slots=True)
class Evidence:
    """One fact: when (wall, ns), who says so, what."""

    log_time_ns: int
    source: str
    text: str
    tick: int | None = None


@dataclass(slots=True)
class Incident:
    """Something that kept a motion from its end, or from its beginning."""

    kind: str
    log_time_ns: int
    message: str
    group: str | None = None
    tick: int | None = None
    evidence: list[Evidence] = field(default_factory=list)


def incidents(found: Findings) -> list[Incident]:
    """All of them, by time."""
    every = [*_stops(found), *_faults(found), *_refusals(found), *_deaths(found)]
    return sorted(every, key=lambda incident: incident.log_time_ns)


# --- stops ----------------------------------------------------------------------------------------------------------


def _stops(found: Findings) -> Iterator[Incident]:
    for time, event in found.story.of_kind(EventKind.MOVE_STOPPING):
        plan_id, reason = event.details.get("plan_id"), event.details.get("reason") or "no reason given"
        spans = [span for span in found.changes.played if span.plan_id == plan_id]
        message = f"{event.group} was brought to rest on its path: {reason}"
        incident = Incident("stop", time, message, event.group, event.tick)
        end_ns = max((span.end_ns for span in spans), default=time) + AFTER_NS
        incident.evidence = _in_order(
            [
                *_asked(found, plan_id),
                *_who_stopped(found, time, str(reason)),
                *_said(found, time - BEFORE_NS, end_ns, event.group, {id(event)}),
                Evidence(time, event.source, event.message, event.tick),
                *_played(found, spans, event.tick),
                *_drives(found, time - BEFORE_NS, end_ns, event.group),
                *_endings(found, plan_id),
            ]
        )
        yield incident


def _asked(found: Findings, plan_id: object) -> Iterator[Evidence]:
    plan = found.story.plans.get(plan_id) if isinstance(plan_id, int) else None
    if plan is None:
        return
    planned = f", planned {plan.reply.duration_s:.3f} s" if plan.reply else ""
    text = f"{plan.user or 'somebody'} asked for a {plan.move.get('kind', '?')} move of {plan.group}{planned}"
    for time, request in found.story.commands():
        if request.request_id == plan.request_id:
            yield Evidence(time, "request", text)
            return
    yield Evidence(found.story.plan_times.get(plan.plan_id, found.begin_ns), "plan", text)


def _who_stopped(found: Findings, time_ns: int, reason: str) -> Iterator[Evidence]:
    """The last `stop`, `hold` or `disable` before it; the last renewal of a lease that lapsed."""
    before = [(at, one) for at, one in found.story.commands() if at <= time_ns + SAME_NS]
    if reason in ("stop", "hold", "disable"):
        asked = [
            (at, one) for at, one in before if one.verb == reason and one.error is None and at > time_ns - BEFORE_NS
        ]
        yield from (Evidence(_received(at, one), "request", f"{one.user} sent {reason}") for at, one in asked[-1:])
    if LEASE_WORDS in reason:
        kept = [(at, one) for at, one in before if one.verb == "lease" and one.error is None]
        for at, one in kept[-1:]:
            seconds = (time_ns - at) / 1e9
            what = (one.body or {}).get("action", "a message")
            text = f"the last about a lease before it, {seconds:.2f} s earlier: {what} of {one.user}"
            yield Evidence(at, "request", text)


def _said(found: Findings, begin_ns: int, end_ns: int, group: str | None, but: set[int]) -> Iterator[Evidence]:
    """Events that explain, of the group or of the whole service."""
    for time, event in found.story.of_kind(*CAUSES):
        if begin_ns <= time <= end_ns and id(event) not in but and _concerns(found, event, group):
            yield Evidence(time, event.source, f"{event.kind}: {event.message}", event.tick)


def _concerns(found: Findings, event: Event, group: str | None) -> bool:
    return event.group is None or group is None or bool(_members(found, event.group) & _members(found, group))


def _members(found: Findings, group: str) -> set[int]:
    try:
        return set(found.run.cell.members(group))
    except KeyError:
        return set()


def _played(found: Findings, spans: list[Played], tick: int | None) -> Iterator[Evidence]:
    """What the ticks show: where the path clock began to slow, how long it took, where it came to rest."""
    for span in spans[:1]:
        slowed = span.slowed_tick if tick is None else tick + 1
        if slowed is None or span.slowed_tick is None:
            continue
        period_ns = found.run.cell.period_ns
        rest = next((change for change in found.changes.groups if _left_stopping(change, span, slowed)), None)
        at_ns = span.begin_ns + (slowed - span.first_tick) * period_ns
        yield Evidence(at_ns, "ticks", "the path clock slows from this tick on", slowed)
        if rest is not None:
            yield Evidence(rest.log_time_ns, "ticks", _outcome(found, span, rest, slowed), rest.tick)


def _outcome(found: Findings, span: Played, change: Change, slowed: int) -> str:
    """Resumed before it was at rest, or at rest: where, if it was the end of the move."""
    took = (change.tick - slowed) * found.run.cell.period_ns / 1e9
    if change.after == GroupState.MOVING:
        return f"resumed after {took:.3f} s, still slowing"
    plan = found.story.plans.get(span.plan_id)
    share = f", {span.path_s / plan.knots[-1]:.1%} of its path" if plan and plan.knots else ""
    where = "" if change.after == GroupState.HELD else f", at {span.path_s:.3f} s{share}"
    return f"at rest after {took:.3f} s{where}: {group_state(change.after)}"


def _left_stopping(change: Change, span: Played, slowed: int) -> bool:
    mine = change.session == span.session and change.index == span.group
    return mine and change.before == GroupState.STOPPING and change.tick >= slowed


def _drives(found: Findings, begin_ns: int, end_ns: int, group: str | None) -> Iterator[Evidence]:
    members = _members(found, group) if group else set(range(len(found.run.cell.groups)))
    axes = {axis for member in members for axis in found.run.cell.axis_indices(found.run.cell.group_names[member])}
    for change in found.changes.drives:
        if begin_ns <= change.log_time_ns <= end_ns and change.index in axes:
            name, state = found.run.cell.axes[change.index].name, drive_state(change.after)
            yield Evidence(change.log_time_ns, "drive", f"{name}: {drive_state(change.before)} -> {state}", change.tick)


def _endings(found: Findings, plan_id: object) -> Iterator[Evidence]:
    for time, event in found.story.of_kind(EventKind.MOVE_ENDED, EventKind.MOVE_RESUMED):
        if event.details.get("plan_id") == plan_id:
            yield Evidence(time, event.source, event.message, event.tick)


# --- faults, refusals, deaths ---------------------------------------------------------------------------------------


def _faults(found: Findings) -> Iterator[Incident]:
    """Groups that went into fault, whether they moved or not."""
    for time, event in found.story.of_kind(EventKind.GROUP_STATE):
        if event.details.get("after") != GroupState.FAULT.label:
            continue
        reason = event.details.get("reason") or "no reason given"
        incident = Incident("fault", time, f"{event.group} is in fault: {reason}", event.group, event.tick)
        incident.evidence = _in_order(
            [
                *_said(found, time - BEFORE_NS, time + SAME_NS, event.group, {id(event)}),
                *_drives(found, time - BEFORE_NS, time + AFTER_NS, event.group),
                Evidence(time, event.source, event.message, event.tick),
            ]
        )
        yield incident


def _refusals(found: Findings) -> Iterator[Incident]:
    for time, request in found.story.commands():
        if request.error is None:
            continue
        group = _group_of(request)
        message = f"{request.verb} of {request.user} was refused: {request.error.code}: {request.error.message}"
        incident = Incident("refusal", time, message, group, request.tick)
        incident.evidence = _in_order([*_refused(found, time, request, group)])
        yield incident


def _received(answered_ns: int, request: RequestLog) -> int:
    """When a request came, wall, ns; it is logged when it is answered."""
    return answered_ns - round((request.answered_s - request.received_s) * 1e9)


def _group_of(request: RequestLog) -> str | None:
    group = (request.body or {}).get("group")
    return group if isinstance(group, str) else None


def _refused(found: Findings, time: int, request: RequestLog, group: str | None) -> Iterator[Evidence]:
    received = _received(time, request)
    waited = (request.answered_s - request.received_s) * 1e3
    yield Evidence(received, "request", f"{request.user} sent {request.verb} {group or ''}".rstrip())
    states = {c.index: c for c in found.changes.groups if c.log_time_ns <= time}
    for member in sorted(_members(found, group)) if group else ():
        if member in states:
            change, name = states[member], found.run.cell.group_names[member]
            text = f"{name} was {group_state(change.after)} since then"
            yield Evidence(change.log_time_ns, "ticks", text, change.tick)
    given = request.error.details if request.error else {}
    details = ", ".join(f"{key}={_short(value)}" for key, value in given.items())
    yield Evidence(time, "front", f"refused after {waited:.1f} ms" + (f": {details[:300]}" if details else ""))


def _short(value: object) -> str:
    """Of a detail: six digits are enough for people."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return f"[{', '.join(map(_short, value))}]" if isinstance(value, list | tuple) else str(value)


def _deaths(found: Findings) -> Iterator[Incident]:
    for time, event in found.story.of_kind(EventKind.PROCESS_DIED, EventKind.CYCLE_FAILED, EventKind.BUS_FAILED):
        incident = Incident("process", time, event.message, event.group, event.tick)
        incident.evidence = [Evidence(time, event.source, f"{event.kind}: {event.message}", event.tick)]
        yield incident


def _in_order(evidence: list[Evidence]) -> list[Evidence]:
    return sorted(evidence, key=lambda one: one.log_time_ns)
