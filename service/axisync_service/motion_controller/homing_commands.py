"""Carries out `home`: which groups may, what ends it, and what becomes of the group afterwards."""

from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorCode
from axisync_schemas.events import EventKind
from axisync_service.motion_controller.demand import Inputs
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.homing import GroupHoming
from axisync_service.motion_controller.motions import Motions
from axisync_service.motion_controller.voice import Voice


class HomingCommands:
    """The homings of all groups.

    Attributes:
        changes: how often an axis was homed, or was found not to be any longer.
    """

    def __init__(self, together: list[bool], groups: list[GroupMachine], motions: Motions, voice: Voice) -> None:
        self._together, self._groups, self._motions, self._voice = together, groups, motions, voice
        self.changes = 0

    def take(self, ref: int, groups: list[GroupMachine]) -> None:
        """Begins, or refuses: every group must stand still, enabled."""
        concerned = [group for group in groups if any(d.axis.drive.homing is not None for d in group.drives)]
        if not concerned:
            names = ", ".join(group.name for group in groups)
            why = f"nothing to home: no drive of {names} has `homing` in the cell file"
            return self._voice.refuse(ref, ErrorCode.INVALID_REQUEST, why)
        for group in concerned:
            if group.state is not GroupState.STANDSTILL or group.fault:
                code, fix = _REFUSALS.get(group.state, (ErrorCode.BUSY, "wait for its end, or stop it"))
                why = f"{group.name} is {group.state.label}, homing begins at standstill: {fix}"
                return self._voice.refuse(ref, code, why, group=group.name, state=group.state.label)
        for group in concerned:
            group.homing, group.reason = GroupHoming(ref, group.drives, self._together[group.index]), None
            self._voice.enter(group, GroupState.HOMING)
        return self._voice.owe(ref, concerned)

    def react(self, group: GroupMachine, inputs: Inputs, stopped: bool) -> None:
        """What ends a homing early: a stop, a lapsed lease, front gone, the end of the service."""
        if group.homing is None or group.homing.failure is not None:
            return
        if stopped:
            self.stop(group, "stop", inputs.now_ns)
        elif inputs.stopping:
            self.stop(group, "the service stops", inputs.now_ns)
        elif inputs.leases_needed and not inputs.front:
            self.stop(group, "front is gone", inputs.now_ns)
        elif inputs.leases_needed and inputs.lease_until_ns[group.index] < inputs.now_ns:
            self.stop(group, "lease lapsed", inputs.now_ns)

    def stop(self, group: GroupMachine, reason: str, now_ns: int) -> None:
        """Halts drives that seek their home."""
        if group.homing is not None:
            group.homing.abort(reason, now_ns)
            self._voice.enter(group, GroupState.STOPPING)

    def pursue(self, now_ns: int) -> None:
        """Moves homings on by one tick."""
        for group in self._groups:
            if group.homing is not None:
                self._pursue(group, group.homing, now_ns)

    def _pursue(self, group: GroupMachine, homing: GroupHoming, now_ns: int) -> None:
        for drive in homing.step(now_ns):
            self.changes += 1
            text = f"{drive.axis.name} is homed"
            name, serial = drive.axis.name, drive.homed_serial
            self._voice.say(EventKind.AXIS_HOMED, text, group.name, axis=name, serial=serial)
        if not homing.done:
            return
        group.homing = None
        if homing.failure is not None:
            reason = f"{group.name} was not homed: {homing.failure}"
            self._voice.say(EventKind.HOMING_FAILED, reason, group.name, "error")
            code = ErrorCode.FAULTED if homing.stuck else ErrorCode.WRONG_STATE
            self._voice.answer(group, code, reason, homing.ref)
        if homing.stuck:
            self._motions.abort(group, homing.failure or "a drive does not follow its target after homing")
            return
        group.reason = homing.failure
        self._voice.enter(group, GroupState.STANDSTILL)
        self._voice.answer(group, only=homing.ref)


_REFUSALS = {
    GroupState.DISABLED: (ErrorCode.NOT_ENABLED, "enable it first"),
    GroupState.FAULT: (ErrorCode.FAULTED, "reset it first"),
    GroupState.HELD: (ErrorCode.WRONG_STATE, "stop ends the held move"),
}
