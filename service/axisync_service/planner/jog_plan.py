"""Plans a jog: a straight way as far as it may go, ending at rest, checked like any move."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisync_robot.collision import Near
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import Jog, PlanJob
from axisync_schemas.plan_slots import Plan
from axisync_schemas.replies import JogAhead
from axisync_service.planner.clearance import CHORD, Guard, Sampled
from axisync_service.planner.jog_ways import JOINTS, End, Way, joint_way, tool_way
from axisync_service.planner.leg import Contacts
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import Checked, Planned, check_leg, planned

Array = NDArray[np.float64]

CUTS, ATTEMPTS = 16, 8
EXACT = 4
"""So many cuts where something is met; beside another group's way that need not be the first such place."""
BACK = 0.004
"""rad: a way ends so far before what it was found to meet."""
SHORTER = 0.7
NEAR, SLACK = 3e-3, 2e-3
"""m: within this of the margin a jog may lead away only; a path's check then leaves this to rounding."""
LOOKS = 32
PASSABLE = frozenset(
    {ErrorCode.COLLISION, ErrorCode.JOINT_LIMIT, ErrorCode.SINGULAR_PATH, ErrorCode.SOFT_LIMIT, ErrorCode.UNREACHABLE}
)
"""Why a way may be too long, so that a shorter one may do."""


def plan_jog(models: Models, job: PlanJob, others: tuple[Plan, ...] = ()) -> Planned:
    """Plans the jog of `job` beside the plans of other groups.

    Raises:
        Refusal: there is no room that way at all (SOFT_LIMIT, UNREACHABLE, SINGULAR_PATH, COLLISION, JOINT_LIMIT);
            INVALID_REQUEST.
    """
    assert isinstance(job.move, Jog)
    start = np.array(job.start)
    if job.move.space == "joint":
        way = joint_way(models, job.group, np.array(job.move.velocity), start)
    else:
        way = tool_way(models, job.group, job.move, start)
    _check_room(job.group, way)
    near, contacts = _surroundings(models, job)
    try:
        return _as_far(
            models, job, way, Guard(models.cell, models.collision, job.group, np.array(job.rest)), contacts, others
        )
    except Refusal as refusal:
        margin = models.cell.geometry.margin
        if refusal.code is not ErrorCode.COLLISION or near is None or near.distance > margin + NEAR:
            raise
        outwards = _away(models, job, way, contacts, near, refusal)
        kept = max(0.0, near.distance - SLACK)
        guard = Guard(models.cell, models.collision, job.group, np.array(job.rest), kept)
        return _as_far(models, job, outwards, guard, contacts, others)


def _surroundings(models: Models, job: PlanJob) -> tuple[Near | None, Contacts]:
    """The nearest pair as the cell stands, and the contacts of the cell file, where it stands in one."""
    near = models.collision.clearance(job.rest)
    contacts = models.cell.geometry.contacts
    if near is None or near.distance >= models.cell.geometry.margin or not contacts:
        return near, ()
    apart = models.collision.clearance(job.rest, contacts)
    touching = apart is None or apart.distance > near.distance
    return (apart, contacts) if touching else (near, ())


def _as_far(
    models: Models, job: PlanJob, way: Way, guard: Guard, contacts: Contacts, others: tuple[Plan, ...]
) -> Planned:
    """The longest part of the way that may be played, of those tried.

    Raises:
        Refusal: of the shortest of them.
    """
    way = _clear(job.group, way, guard, contacts, others)
    for attempt in range(1, ATTEMPTS + 1):
        try:
            leg = replace(way.leg(), contacts=contacts)
            checked: Checked = check_leg(models, job.group, guard, leg, others)
            slower = way.pace.share / leg.scale
            limited_by = f"the limits of {leg.limiting}" if leg.scale > 1.001 else way.pace.limited_by
            assert isinstance(job.move, Jog)
            ahead = JogAhead(
                velocity=tuple(slower * value for value in job.move.velocity),
                limited_by=limited_by,
                ends_at=way.end.words if way.end is not None else None,
            )
            return planned(models, job, [leg], checked, ahead)
        except Refusal as refusal:
            if refusal.code not in PASSABLE:
                raise
            way = _cut(job.group, way, SHORTER * way.duration if attempt < ATTEMPTS else 0.0, refusal)
    raise AssertionError("a way of no length leads nowhere")


def _clear(group: str, way: Way, guard: Guard, contacts: Contacts, others: tuple[Plan, ...]) -> Way:
    """As far as nothing comes near."""
    speed = float(np.abs(np.diff(way.q, axis=0)).max() / np.diff(way.times).max())
    for cut in range(1, CUTS + 1):
        chord = np.full(way.q.shape[1], CHORD)
        samples = Sampled(way.times, way.q, chord, np.broadcast_to(chord, way.q.shape))
        try:
            guard.check_samples(samples, contacts, others, alone=False)
        except Refusal as refusal:
            if refusal.code is not ErrorCode.COLLISION:
                raise
            time = float(refusal.details["time_s"]) - BACK / speed
            if cut > EXACT:
                time = min(time, SHORTER * way.duration)
            way = _cut(group, way, time if cut < CUTS else 0.0, refusal)
        else:
            return way
    raise AssertionError("a way of no length leads nowhere")


def _away(models: Models, job: PlanJob, way: Way, contacts: Contacts, near: Near, refusal: Refusal) -> Way:
    """As far as no sample is nearer to anything than where it stands now.

    Raises:
        Refusal: `refusal`, where that is nowhere.
    """
    axes = models.cell.axis_indices(job.group)
    pose = np.array(job.rest)
    looks = np.unique(np.linspace(0, len(way.times) - 1, LOOKS).astype(np.intp))[1:]
    kept = 0.0
    for look in looks.tolist():
        pose[list(axes)] = way.q[look]
        found = models.collision.clearance(pose, contacts)
        if found is not None and found.distance < near.distance:
            break
        kept = float(way.times[look])
    else:
        return way
    if kept == 0.0:
        raise refusal
    return _cut(job.group, way, kept, refusal)


def _cut(group: str, way: Way, time: float, refusal: Refusal) -> Way:
    """The way up to a time.

    Raises:
        Refusal: that is nothing.
    """
    shorter = way.until(time, _end_of(refusal))
    _check_room(group, shorter)
    return shorter


def _end_of(refusal: Refusal) -> End:
    details = refusal.details
    if refusal.code is ErrorCode.COLLISION:
        first, second = details["pair"]
        told = ("pair", "distance_m", "margin_m", "alone")
        fix = details.get("fix")
        fixed = "jog the other way" if fix is None else "jog the other way, or wait until the other group stands"
        return End(
            refusal.code, f"{first} and {second} would come too near", {key: details[key] for key in told}, fixed
        )
    wanted = {key: value for key, value in details.items() if key not in ("fix", "nearest_reachable")}
    fix = JOINTS if refusal.code is ErrorCode.SINGULAR_PATH else "jog the other way"
    return End(refusal.code, refusal.message, wanted, fix)


def _check_room(group: str, way: Way) -> None:
    """
    Raises:
        Refusal: the way is blocked where it begins.
    """
    if way.end is None or not way.leads_nowhere:
        return
    end = way.end
    message = f"{group} cannot be jogged that way: {end.words}"
    raise Refusal(end.code, message, **{**end.details, "group": group, "fix": end.fix})
