"""Carries out enable, disable, reset and begin, and pursues what they have set going."""

from collections.abc import Callable

import numpy as np

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import DriveState, GroupState
from axisync_schemas.errors import ErrorCode
from axisync_schemas.events import EventKind
from axisync_schemas.internal import JOG_RELEASED, BeginCommand, Command, DriveCommand, JogCommand, OverrideCommand
from axisync_schemas.plan_slots import Plan, PlanError, PlanReader
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.demand import Array, Inputs
from axisync_service.motion_controller.drive_access import DriveAccess
from axisync_service.motion_controller.groups import (
    DISABLE_TIMEOUT_NS,
    ENABLE_TIMEOUT_NS,
    RESET_TIMEOUT_NS,
    Goal,
    GroupMachine,
)  # fmt: skip
from axisync_service.motion_controller.homing_commands import HomingCommands
from axisync_service.motion_controller.motions import Motions
from axisync_service.motion_controller.plan_check import fault_of
from axisync_service.motion_controller.player import Motion
from axisync_service.motion_controller.voice import Voice

START_TOLERANCE = 1e-9
"""A plan must begin at the setpoint, rad: the planner was given its exact bits."""

OpenPlan = Callable[[int, int], PlanReader]
"""Opens a plan slot that must hold the plan with this id; PlanError otherwise."""


class Commands:
    """What front, or a plan file, asks for."""

    def __init__(
        self, cell: Cell, groups: list[GroupMachine], motions: Motions, voice: Voice, open_plan: OpenPlan
    ) -> None:
        """`open_plan` opens a slot of shared memory."""
        self._cell, self._groups, self._motions, self._voice = cell, groups, motions, voice
        drives: list[DriveLink] = [drive for group in groups for drive in group.drives]
        self._access = DriveAccess(groups, drives, voice)
        self.homing = HomingCommands([group.homing_together for group in cell.groups], groups, motions, voice)
        self._open_plan = open_plan
        self._loading: list[tuple[BeginCommand, PlanReader]] = []

    def take(self, command: Command, inputs: Inputs) -> None:
        """Begins to carry a command out, or refuses it."""
        if inputs.stopping:
            return self._voice.refuse(command.ref, ErrorCode.UNAVAILABLE, "the service stops")
        if isinstance(command, DriveCommand):
            return self._access.take(command)
        try:
            groups = [self._groups[index] for index in self._cell.members(command.group)]
        except KeyError:
            return self._voice.refuse(command.ref, ErrorCode.NOT_FOUND, f"no group {command.group}")
        if isinstance(command, BeginCommand):
            self._begin(command)
        elif isinstance(command, JogCommand):
            self._jog(command, groups)
        elif isinstance(command, OverrideCommand):
            self._motions.override(groups, command.value)
            self._voice.done(command.ref)
        elif command.op == "hold":
            self._hold(command.ref, groups)
        elif command.op == "resume":
            self._resume(command.ref, groups, inputs)
        elif command.op == "enable":
            self._enable(command.ref, groups, inputs.now_ns)
        elif command.op == "disable":
            self._disable(command.ref, groups, inputs.now_ns)
        elif command.op == "home":
            self.homing.take(command.ref, groups)
        else:
            self._reset(command.ref, groups, inputs.now_ns)
        return None

    # --- enable, disable, reset ---------------------------------------------------------------------------------

    def _enable(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        for group in groups:
            cannot = f"{group.name} cannot be enabled: "
            if group.state is GroupState.FAULT:
                why = f"{group.name} is in fault ({group.fault}): reset it first"
                return self._voice.refuse(ref, ErrorCode.FAULTED, why, group=group.name, reason=group.fault)
            if drives := group.not_ready():
                why = cannot + "; ".join(drives)
                return self._voice.refuse(ref, ErrorCode.UNAVAILABLE, why, group=group.name, drives=drives)
            if drives := group.faulted():
                why = cannot + "; ".join(drives) + ": reset it first"
                return self._voice.refuse(ref, ErrorCode.FAULTED, why, group=group.name, drives=drives)
            if drives := group.torque_off():
                why = cannot + "; ".join(drives)
                return self._voice.refuse(ref, ErrorCode.WRONG_STATE, why, group=group.name, drives=drives)
        for group in groups:
            if group.state is GroupState.DISABLED:
                group.goal, group.deadline_ns, group.hold_until_ns = Goal.ENABLED, now_ns + ENABLE_TIMEOUT_NS, 0
                group.quick_stop.clear()
                for drive in group.drives:
                    drive.rebooted = False
        self._voice.owe(ref, [group for group in groups if group.enabling])
        return None

    def _disable(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        for group in groups:
            if group.motion is not None:
                self._motions.stop(group.motion, "disable")
            self.homing.stop(group, "disable", now_ns)
            if group.motion is not None or group.homing is not None:
                group.disable_at_rest = True
            elif group.goal is Goal.ENABLED:
                self.switch_off(group, now_ns)
        self._voice.owe(ref, [group for group in groups if group.disable_at_rest or not group.all_off])

    def switch_off(self, group: GroupMachine, now_ns: int) -> None:
        """Leads the drives of a group at rest to switch-on-disabled."""
        group.goal, group.deadline_ns, group.disable_at_rest = Goal.DISABLED, now_ns + DISABLE_TIMEOUT_NS, False
        if group.state is not GroupState.FAULT:
            self._voice.enter(group, GroupState.DISABLED)

    def _reset(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        for group in groups:
            if group.fault and group.state is not GroupState.FAULT:
                why = f"{group.name} is still stopping"
                return self._voice.refuse(ref, ErrorCode.WRONG_STATE, why, group=group.name)
        waiting = [group for group in groups if not group.following]  # one that is enabled and well needs no reset
        for group in waiting:
            group.goal, group.deadline_ns = Goal.RESET, now_ns + RESET_TIMEOUT_NS
            for drive in group.drives:
                if drive.bring_up.failure is not None:  # No need to wait for the next attempt.
                    drive.bring_up.retry()
        self._voice.owe(ref, waiting)
        return None

    # --- hold, resume -------------------------------------------------------------------------------------------

    def _hold(self, ref: int, groups: list[GroupMachine]) -> None:
        """Brings what moves to rest on its path, until it is resumed."""
        moving = [group for group in groups if group.motion is not None]
        if not moving:
            names = ", ".join(group.name for group in groups)
            return self._voice.refuse(ref, ErrorCode.WRONG_STATE, f"{names}: no move to hold")
        for group in moving:
            assert group.motion is not None
            self._motions.hold(group.motion, "hold")
        self._voice.done(ref)
        return None

    def _resume(self, ref: int, groups: list[GroupMachine], inputs: Inputs) -> None:
        """Goes on with moves that are held, or slowing to be held; nobody but a lease holder resumes."""
        held = [group for group in groups if group.motion is not None and group.motion.resumable]
        if not held:
            states = ", ".join(f"{group.name} is {group.state.label}" for group in groups)
            return self._voice.refuse(ref, ErrorCode.WRONG_STATE, f"{states}: nothing is held")
        for group in held:
            assert group.motion is not None
            for member in group.motion.members:
                if inputs.leases_needed and inputs.lease_until_ns[member] < inputs.now_ns:
                    why = f"the lease of {self._groups[member].name} has lapsed"
                    return self._voice.refuse(ref, ErrorCode.LEASE_REQUIRED, why)
        for motion in {id(group.motion): group.motion for group in held}.values():
            assert motion is not None
            self._motions.resume(motion)
        self._voice.done(ref)
        return None

    # --- jog ----------------------------------------------------------------------------------------------------

    def _jog(self, command: JogCommand, groups: list[GroupMachine]) -> None:
        """A sign of life from whoever jogs, and how fast to go on; a share of 0 is the end of it."""
        motion = groups[0].motion
        if motion is None or motion.plan_id != command.plan_id or motion.jog_until_ns is None or motion.slowing:
            why = f"{command.group} is not on jog {command.plan_id} any longer"
            return self._voice.refuse(command.ref, ErrorCode.WRONG_STATE, why)
        if command.share == 0.0:
            self._motions.stop(motion, JOG_RELEASED)
        else:
            motion.jog_until_ns = command.until_ns
            self._motions.share(motion, command.share)
        self._voice.done(command.ref)
        return None

    # --- begin --------------------------------------------------------------------------------------------------

    def _begin(self, command: BeginCommand) -> None:
        try:
            self._loading.append((command, self._open_plan(command.slot, command.plan_id)))
        except PlanError as error:
            self._voice.refuse(command.ref, ErrorCode.INTERNAL, str(error))

    def load(self, inputs: Inputs, setpoint: Array) -> None:
        """Takes over plans piece by piece; those that are whole and may start, do."""
        loading, self._loading = self._loading, []
        for command, reader in loading:
            if not reader.advance():
                self._loading.append((command, reader))
                continue
            try:
                plan = reader.plan()
            except PlanError as error:
                self._voice.refuse(command.ref, ErrorCode.INTERNAL, str(error))
                continue
            refusal = self._refusal(command, plan, inputs, setpoint)
            if refusal is None:
                members = self._cell.members(command.group)
                motion = Motion(plan, command.slot, command.group, members, self._cell.period, command.jog_until_ns)
                self._motions.start(motion, plan.duration)
                self._voice.done(command.ref)
            else:
                self._voice.refuse(command.ref, *refusal)

    def _refusal(
        self, command: BeginCommand, plan: Plan, inputs: Inputs, setpoint: Array
    ) -> tuple[ErrorCode, str] | None:
        """Why a plan may not be played now. The last border: nothing is believed that can be checked."""
        members = self._cell.members(command.group)
        for position, member in enumerate(members):
            group = self._groups[member]
            if group.state is not GroupState.STANDSTILL or group.fault:
                code = ErrorCode.FAULTED if group.state is GroupState.FAULT else ErrorCode.WRONG_STATE
                return code, f"{group.name} is {group.state.label}, not standstill"
            if missing := group.not_homed():
                return ErrorCode.NOT_HOMED, f"{', '.join(missing)} must be homed first"
            if not inputs.leases_needed:
                continue
            if len(command.epochs) != len(members) or command.epochs[position] != inputs.lease_epochs[member]:
                return ErrorCode.LEASE_FENCED, f"the lease of {group.name} has changed hands"
            if command.stop_counts and command.stop_counts[position] != inputs.stop_counts[member]:
                return ErrorCode.WRONG_STATE, f"{group.name} was stopped meanwhile"
            if not inputs.front or inputs.lease_until_ns[member] < inputs.now_ns:
                return ErrorCode.LEASE_REQUIRED, f"the lease of {group.name} has lapsed"
        if command.jog_until_ns is not None and command.jog_until_ns < inputs.now_ns:
            return ErrorCode.STALE, f"the time of this jog of {command.group} was over before it began"
        if tuple(plan.axes.tolist()) != self._cell.axis_indices(command.group):
            return ErrorCode.INTERNAL, f"plan {plan.plan_id} is not for the axes of {command.group}"
        if fault := fault_of(plan, [self._cell.axes[axis] for axis in plan.axes.tolist()]):
            return ErrorCode.INTERNAL, f"plan {plan.plan_id} is not played: {fault}"
        if np.abs(plan.start - setpoint[plan.axes]).max() > START_TOLERANCE:
            return ErrorCode.WRONG_STATE, f"plan {plan.plan_id} does not begin at the setpoint"
        return None

    # --- goals --------------------------------------------------------------------------------------------------

    def pursue(self, now_ns: int) -> None:
        """Moves groups on towards the goals that commands have set."""
        self.homing.pursue(now_ns)
        for group in self._groups:
            if group.disable_at_rest and group.motion is None and group.homing is None:
                self.switch_off(group, now_ns)
            if group.enabling:
                self._pursue_enable(group, now_ns)
            elif group.goal is Goal.RESET:
                self._pursue_reset(group, now_ns)
            elif group.goal is Goal.DISABLED and group.owed:
                self._pursue_disable(group, now_ns)

    def _pursue_enable(self, group: GroupMachine, now_ns: int) -> None:
        if not group.all_enabled:
            group.hold_until_ns = 0
            lost = group.not_ready()
            if lost or now_ns > group.deadline_ns:
                waiting = [d for d in group.drives if d.state is not DriveState.OPERATION_ENABLED]
                slow = [drive.why_not_enabled() for drive in waiting]
                self._give_up_enabling(group, "; ".join(lost or slow))
        elif not group.hold_until_ns:
            brake = max(drive.axis.drive.brake_release for drive in group.drives)
            group.hold_until_ns = now_ns + round(brake * 1e9)
        elif now_ns >= group.hold_until_ns:
            group.reason = None
            self._voice.enter(group, GroupState.STANDSTILL)
            self._voice.answer(group)

    def _give_up_enabling(self, group: GroupMachine, why: str) -> None:
        group.goal = Goal.DISABLED
        reason = f"{group.name} was not enabled: {why}"
        self._voice.say(EventKind.DRIVE_FAULT, reason, group.name, "error")
        self._voice.answer(group, ErrorCode.FAULTED, reason)

    def _pursue_reset(self, group: GroupMachine, now_ns: int) -> None:
        why = group.faulted() or group.not_ready()
        if not why:
            group.goal, group.reason, group.fault = Goal.DISABLED, None, None
            group.quick_stop.clear()
            for drive in group.drives:
                drive.rebooted, drive.emergency = False, None
            self._voice.enter(group, GroupState.DISABLED)
            self._voice.answer(group)
        elif now_ns > group.deadline_ns:
            group.goal = Goal.DISABLED
            self._voice.answer(group, ErrorCode.FAULTED, f"{group.name} could not be reset: " + "; ".join(why))

    def _pursue_disable(self, group: GroupMachine, now_ns: int) -> None:
        if group.all_off:
            self._voice.answer(group)
        elif now_ns > group.deadline_ns:
            on = [d.axis.name for d in group.drives if d.state is DriveState.OPERATION_ENABLED]
            self._voice.answer(group, ErrorCode.INTERNAL, f"drives stay enabled: {', '.join(on)}")
