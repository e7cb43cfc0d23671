"""Errors and endings in one sentence each, with what to type next."""

from axisync_client import AxisyncError, ErrorCode, LeaseLost, Refused
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.replies import MoveReply, MoveReport

_WHAT_TO_TYPE = {
    ErrorCode.NOT_ENABLED: "run `axisync enable {group}`",
    ErrorCode.NOT_HOMED: "run `axisync home {group}`",
    ErrorCode.FAULTED: "run `axisync reset {group}`, then `axisync enable {group}`",
    ErrorCode.LEASE_HELD: "`axisync lease` shows the holders, --take takes over",
    ErrorCode.LEASE_FENCED: "`axisync lease` shows the holders",
    ErrorCode.NOT_FOUND: "`axisync state` shows the groups",
    ErrorCode.BUSY: "wait for the end, or run `axisync stop {group}`",
}

_WHEN_LOST = "`axisync lease` shows the holders, `axisync state` what the move does, `axisync stop {group}` ends it"


def of_error(error: AxisyncError, group: str | None) -> str:
    """One sentence: what is wrong, and the fix where there is one."""
    about = _about(error, group)
    if error.code is ErrorCode.NOT_ENABLED and about is not None:
        return f"{about} is disabled: run `axisync enable {about}`"
    fix = error.fix
    if isinstance(error, LeaseLost):
        fix = _WHEN_LOST.format(group=about or "GROUP")
    if fix is None and isinstance(error, Refused) and error.code in _WHAT_TO_TYPE:
        fix = _WHAT_TO_TYPE[error.code].format(group=about or "GROUP")
    message = error.message.rstrip(". \n")
    return message if fix is None or fix in message else f"{message}: {fix}"


def _about(error: AxisyncError, group: str | None) -> str | None:
    if isinstance(error, Refused) and isinstance(named := error.details.get("group"), str):
        return named
    return group


def of_acceptance(reply: MoveReply) -> str:
    """Printed when a move is accepted."""
    limited = f", limited by {reply.limiting}" if reply.limiting else ""
    steps = f" in {len(reply.steps)} steps" if reply.steps else ""
    stretched = f" (stretched {reply.scale:.3g} times)" if reply.scale > 1.0 and reply.limiting else ""
    return f"move {reply.move_id}: {reply.group} takes {reply.duration_s:.3f} s{steps}{limited}{stretched}"


def of_progress(reply: MoveReply, progress: float) -> str:
    """What the bar says: the group, and of a sequence the step that it is in."""
    begun = [number for number, step in enumerate(reply.steps, 1) if step.begins_s <= progress * reply.duration_s]
    return f"{reply.group} step {begun[-1]} of {len(reply.steps)}" if begun else reply.group


def of_ending(report: MoveReport) -> str:
    """Printed when a move has ended."""
    if report.status is MoveStatus.SUCCEEDED:
        return f"{report.group} arrived"
    how = {MoveStatus.STOPPED: "was stopped", MoveStatus.HELD: "is held", MoveStatus.FAILED: "failed"}
    reason = f": {report.reason}" if report.reason else ""
    if report.status is MoveStatus.HELD:
        reason += f"; `axisync resume {report.group}` goes on, `axisync stop {report.group}` ends it"
    return f"{report.group} {how.get(report.status, 'moves')} at {report.progress:.0%} of its path{reason}"


def of_states(groups: dict[str, str]) -> str:
    """`kingkong standstill, wukong disabled`."""
    return ", ".join(f"{name} {state}" for name, state in groups.items())
