"""How motions slow, rest and end, and what a fault does to them."""

from typing import Any

from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.errors import ErrorCode
from axisync_schemas.events import EventKind
from axisync_schemas.internal import JOG_LAPSED
from axisync_service.motion_controller.groups import Goal, GroupMachine
from axisync_service.motion_controller.player import Ending, Motion
from axisync_service.motion_controller.voice import Severity, Voice

_STATUS = {Ending.SUCCEEDED: MoveStatus.SUCCEEDED, Ending.STOPPED: MoveStatus.STOPPED, Ending.FAILED: MoveStatus.FAILED}


class Motions:
    """The motions of all groups; a compound's groups share one."""

    def __init__(self, groups: list[GroupMachine], voice: Voice) -> None:
        self._groups, self._voice = groups, voice

    def all(self) -> list[Motion]:
        """Motions under way or held, each once."""
        found: list[Motion] = []
        for group in self._groups:
            if group.motion is not None and group.motion not in found:
                found.append(group.motion)
        return found

    def start(self, motion: Motion, duration_s: float) -> None:
        """The members begin to move."""
        jogged = motion.jog_until_ns is not None
        for member in motion.members:
            group = self._groups[member]
            group.motion, group.reason = motion, None
            self._voice.enter(group, GroupState.JOGGING if jogged else GroupState.MOVING)
        override = self.rate_of(motion)
        motion.set_override(override)
        text = f"{motion.kind} {motion.plan_id} of {motion.group} starts"
        details: dict[str, Any] = {"plan_id": motion.plan_id, "duration_s": duration_s, "override": override}
        self._voice.say(EventKind.MOVE_STARTED, text, motion.group, **details)

    def stop(self, motion: Motion, reason: str) -> None:
        """Ends the move: on the path while it moves, at once where it is held."""
        if self._groups[motion.members[0]].state is GroupState.HELD:
            self.end(motion, Ending.STOPPED, reason)
        else:
            self.slow(motion, Ending.STOPPED, reason)

    def hold(self, motion: Motion, reason: str) -> None:
        """Brings a move to rest until it is resumed; a jog ends, since nobody may resume it but who holds the key."""
        self.slow(motion, Ending.HELD if motion.jog_until_ns is None else Ending.STOPPED, reason)

    def share(self, motion: Motion, share: float) -> None:
        """A jog goes on at this share of the velocity that it was planned with."""
        if share == motion.share:
            return
        motion.share = share
        rate = self.rate_of(motion)
        motion.set_override(rate)
        text = f"jog {motion.plan_id} of {motion.group}: {100.0 * share:.4g} % of its velocity"
        details: dict[str, Any] = {"plan_id": motion.plan_id, "share": share, "rate": rate}
        self._voice.say(EventKind.JOG_SPEED, text, motion.group, **details)

    def expire(self, now_ns: int) -> None:
        """Stops jogs that nobody has asked for in time."""
        for motion in self.all():
            if motion.jog_until_ns is not None and motion.jog_until_ns < now_ns and not motion.slowing:
                self.slow(motion, Ending.STOPPED, JOG_LAPSED)

    def slow(self, motion: Motion, ending: Ending, reason: str) -> None:
        """Brings the motion to rest on its path (GSTOP); what becomes of it then is `ending`."""
        if not motion.slow(ending, reason):
            return
        for member in motion.members:
            self._voice.enter(self._groups[member], GroupState.STOPPING)
        text = f"{motion.kind} {motion.plan_id} slows: {reason}"
        details: dict[str, Any] = {"plan_id": motion.plan_id, "reason": reason, "path_s": motion.path_s}
        self._voice.say(EventKind.MOVE_STOPPING, text, motion.group, **details)

    def resume(self, motion: Motion) -> None:
        """Goes on along the path."""
        motion.resume()
        for member in motion.members:
            group = self._groups[member]
            group.reason = None
            self._voice.enter(group, GroupState.MOVING)
        text = f"{motion.kind} {motion.plan_id} goes on"
        details: dict[str, Any] = {"plan_id": motion.plan_id, "path_s": motion.path_s}
        self._voice.say(EventKind.MOVE_RESUMED, text, motion.group, **details)

    def override(self, groups: list[GroupMachine], value: float) -> None:
        """The rate of groups' path clocks from now on; a motion runs at the lowest of its members'."""
        for group in groups:
            group.override = value
        for motion in self.all():
            motion.set_override(self.rate_of(motion))
        names = ", ".join(group.name for group in groups)
        rates = {str(motion.plan_id): self.rate_of(motion) for motion in self.all()}
        text = f"{names}: override {100.0 * value:g} %"
        self._voice.say(EventKind.OVERRIDE_SET, text, names, value=value, rates=rates)

    def watch_rate(self, motion: Motion, relaxed_before: int) -> None:
        """Says the first time that a motion's rate could not be changed within the limits of moves."""
        if relaxed_before == 0 < motion.relaxed_ticks:
            text = f"move {motion.plan_id}: its rate changes within the stop limits"
            details: dict[str, Any] = {"plan_id": motion.plan_id, "path_s": motion.path_s, "rate": motion.rate}
            self._voice.say(EventKind.RATE_RELAXED, text, motion.group, **details)

    def rate_of(self, motion: Motion) -> float:
        """The lowest override of its members; of a jog, times its share."""
        return motion.share * min(self._groups[member].override for member in motion.members)

    def end(self, motion: Motion, ending: Ending, reason: str | None) -> None:
        """The move is over; a member with a fault of its own is latched, the others stand."""
        status = _STATUS[ending]
        for member in motion.members:
            group = self._groups[member]
            group.motion = None
            if group.fault:
                self.latch(group)
            else:
                group.reason = reason
                self._voice.enter(group, GroupState.STANDSTILL)
        severity: Severity = "error" if ending is Ending.FAILED else "info"
        text = f"{motion.kind} {motion.plan_id} of {motion.group} {status.value}" + (f": {reason}" if reason else "")
        details: dict[str, Any] = {"plan_id": motion.plan_id, "status": status.value, "reason": reason}
        details["relaxed_ticks"] = motion.relaxed_ticks
        self._voice.say(EventKind.MOVE_ENDED, text, motion.group, severity, **details)

    def settle(self, motion: Motion) -> None:
        """A motion has come to rest: at its target, held, or ended early."""
        if motion.ending is Ending.HELD and not motion.arrived:
            for member in motion.members:
                group = self._groups[member]
                group.reason = motion.reason
                self._voice.enter(group, GroupState.HELD)
            return
        succeeded = motion.ending in (Ending.SUCCEEDED, Ending.HELD)
        self.end(motion, Ending.SUCCEEDED if succeeded else motion.ending, None if succeeded else motion.reason)

    # --- faults -------------------------------------------------------------------------------------------------

    def fail_axis(self, group: GroupMachine, axis: int, why: str) -> None:
        """FSTOP: the axis ramps down in its drive, the rest of the coordinated motion stops on its path."""
        drive = group.drives[axis]
        drive.rebooted = False
        group.quick_stop.add(axis)
        reason = f"{drive.axis.name}: {why}"
        details: dict[str, Any] = {"axis": drive.axis.name, "statusword": drive.statusword}
        if drive.emergency:
            details["error_code"] = drive.emergency.code
        self._voice.say(EventKind.DRIVE_FAULT, reason, group.name, "error", **details)
        group.fault = group.fault or reason
        self._give_up_homing(group)
        motion = group.motion
        if motion is not None and group.state in (GroupState.MOVING, GroupState.JOGGING, GroupState.STOPPING):
            self.slow(motion, Ending.FAILED, reason)
        elif motion is not None:
            self.end(motion, Ending.FAILED, reason)
        else:
            self.latch(group)

    def abort(self, group: GroupMachine, reason: str) -> None:
        """All drives of the group ramp down by themselves, now: its path can no longer be kept."""
        group.fault = group.fault or reason
        group.quick_stop.update(range(len(group.drives)))
        self._give_up_homing(group)
        if group.motion is not None:
            self.end(group.motion, Ending.FAILED, reason)
        self.latch(group)

    def _give_up_homing(self, group: GroupMachine) -> None:
        if group.homing is not None:
            group.homing.give_up()
            group.homing = None

    def latch(self, group: GroupMachine) -> None:
        """At rest with a fault: the drives are switched off, and only reset leads on."""
        group.goal, group.disable_at_rest, group.reason = Goal.DISABLED, False, group.fault
        self._voice.enter(group, GroupState.FAULT)
        self._voice.answer(group, ErrorCode.FAULTED, group.fault or "fault")
