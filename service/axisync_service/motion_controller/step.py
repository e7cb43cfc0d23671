"""The decisions of one tick: a pure function of state and inputs. Reads no clock, sends nothing.

At tick k the setpoints of t[k+1] are decided. `advance_skipped` moves motions on over ticks that were not executed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.events import EventKind
from axisync_schemas.internal import BeginCommand, GroupCommand
from axisync_schemas.plan_slots import Plan, PlanError, PlanReader
from axisync_service.canopen.emcy import describe
from axisync_service.drives.link import DriveLink
from axisync_service.mapper.counts import CountMap
from axisync_service.motion_controller.groups import (
    DISABLE_TIMEOUT_NS,
    ENABLE_TIMEOUT_NS,
    RESET_TIMEOUT_NS,
    Goal,
    GroupMachine,
)  # fmt: skip
from axisync_service.motion_controller.player import Ending, Motion

START_TOLERANCE = 1e-9
"""A plan must begin at the setpoint, rad: the planner was given its exact bits."""

Array = NDArray[np.float64]
Severity = Literal["info", "warning", "error"]
_STATUS = {Ending.SUCCEEDED: MoveStatus.SUCCEEDED, Ending.STOPPED: MoveStatus.STOPPED, Ending.FAILED: MoveStatus.FAILED}


@dataclass(slots=True)
class Happening:
    """An event as decided; the edge adds times and sends it."""

    kind: EventKind
    message: str
    group: str | None = None
    severity: Severity = "info"
    details: dict[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class Inputs:
    """What one tick decides on.

    Attributes:
        stop_counts, lease_until_ns, lease_epochs: one for each elementary group, from shared memory.
        leases_needed: False when a plan is played from a file, without front.
        front: somebody is connected who answers for the leases.
    """

    tick: int
    now_ns: int
    skipped: int
    stop_counts: list[int]
    lease_until_ns: list[int]
    lease_epochs: list[int]
    front: bool
    leases_needed: bool
    stopping: bool


@dataclass(slots=True)
class Setpoints:
    """Demand of one instant, all axes [n] and all groups [g]."""

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    plan_id: NDArray[np.uint64]
    path_s: Array
    path_rate: Array
    group_state: NDArray[np.uint32]
    counts: NDArray[np.int32]

    @staticmethod
    def zeros(axes: int, groups: int) -> "Setpoints":
        """Everything at 0."""
        return Setpoints(
            position=np.zeros(axes),
            velocity=np.zeros(axes),
            acceleration=np.zeros(axes),
            jerk=np.zeros(axes),
            plan_id=np.zeros(groups, np.uint64),
            path_s=np.zeros(groups),
            path_rate=np.zeros(groups),
            group_state=np.zeros(groups, np.uint32),
            counts=np.zeros(axes, np.int32),
        )


class Core:
    """Groups, motions and their setpoints.

    Attributes:
        current: setpoints in force at the present tick; upcoming: those of the next, which the RPDOs carry.
        happenings, replies: what to say, taken away by the edge each tick.
        changed: a group changed its state in this tick.
    """

    def __init__(self, cell: Cell, open_plan: Callable[[int, int], PlanReader]) -> None:
        self.cell = cell
        self.drives = [DriveLink(cell, axis) for axis in cell.axes]
        self.groups: list[GroupMachine] = []
        for index, name in enumerate(cell.group_names):
            axes = cell.axis_indices(name)
            first, last = axes[0], axes[-1] + 1
            self.groups.append(GroupMachine(index, name, first, last, self.drives[first:last]))
        self.counts = CountMap(cell.axes)
        n, g = len(cell.axes), len(self.groups)
        self.current, self.upcoming = Setpoints.zeros(n, g), Setpoints.zeros(n, g)
        self.actual_position = np.zeros(n)
        self.statuswords = np.zeros(n, np.uint32)
        self.happenings: list[Happening] = []
        self.replies: list[tuple[int, ErrorBody | None]] = []
        self.changed = True
        self.shut_down = False
        self._open_plan = open_plan
        self._loading: list[tuple[BeginCommand, PlanReader]] = []
        self._stop_counts: list[int] | None = None
        self._demand_before = np.zeros(n)
        self._window = np.array([axis.drive.following_error_max for axis in cell.axes])
        self._hold_on_missed = [axis.drive.on_missed == "hold" for axis in cell.axes]
        self._deadline_ns = 0
        self._failures: dict[str, str] = {}

    # --- the tick -----------------------------------------------------------------------------------------------

    def step(self, inputs: Inputs, commands: list[GroupCommand | BeginCommand]) -> None:
        """Decides one executed tick."""
        self.changed = False
        self._observe(inputs.now_ns)
        self._supervise(inputs)
        self._react(inputs)
        for command in commands:
            self._command(command, inputs)
        self._load(inputs)
        self._pursue(inputs)
        self._demand_before[:] = self.current.position
        self._advance()

    def advance_skipped(self) -> None:
        """After `begin_tick` of a tick that is not executed: motions run on, nothing is decided."""
        self._demand_before[:] = self.current.position
        self._advance()

    def begin_tick(self) -> None:
        """What was upcoming is in force now."""
        self.current, self.upcoming = self.upcoming, self.current

    @property
    def motions(self) -> list[Motion]:
        """Motions under way or held, each once."""
        return list({id(g.motion): g.motion for g in self.groups if g.motion is not None}.values())

    @property
    def still(self) -> bool:
        """Nothing moves and nothing is being enabled: the time for house-keeping."""
        return all(
            g.state in (GroupState.DISABLED, GroupState.STANDSTILL, GroupState.HELD, GroupState.FAULT)
            for g in self.groups
        ) and not any(g.enabling for g in self.groups)

    # --- reading ------------------------------------------------------------------------------------------------

    def _observe(self, now_ns: int) -> None:
        """Actual positions, lost drives, emergencies, and the progress of bring-ups."""
        for group in self.groups:
            for drive in group.drives:
                lost = drive.end_of_read(now_ns)
                if lost is not None:
                    self._say(EventKind.DRIVE_LOST, lost, group, "error", axis=drive.axis.name)
                if drive.new_emergencies:
                    self._say_emergencies(group, drive)
                if not drive.bring_up.ready:
                    drive.bring_up.step(now_ns)
                    self._say_bring_up(group, drive)
        actual = np.array([drive.actual for drive in self.drives], dtype=np.int64)
        self.actual_position = self.counts.to_position(actual)
        self.statuswords[:] = [drive.statusword for drive in self.drives]

    def _say_emergencies(self, group: GroupMachine, drive: DriveLink) -> None:
        for emergency in drive.new_emergencies:
            text = f"{drive.axis.name}: EMCY 0x{emergency.code:04X}, {emergency.words}"
            self._say(EventKind.EMERGENCY, text, group, "error", axis=drive.axis.name, error_code=emergency.code,
                      error_register=emergency.register, manufacturer=emergency.manufacturer.hex())  # fmt: skip
        drive.new_emergencies.clear()

    def _say_bring_up(self, group: GroupMachine, drive: DriveLink) -> None:
        """Once for each failure that differs from the last, and when the drive is ready."""
        bring_up, name = drive.bring_up, drive.axis.name
        if bring_up.failure is not None and self._failures.get(name) != bring_up.failure:
            self._failures[name] = bring_up.failure
            self._say(EventKind.BRING_UP_FAILED, bring_up.failure, group, "error", axis=name)
        elif bring_up.ready:
            self._failures.pop(name, None)
            history = [f"0x{code:04X} {describe(code)}" for code in bring_up.history]
            said = f", it remembers: {', '.join(history)}" if history else ""
            self._say(EventKind.DRIVE_READY, f"{name} is operational{said}", group, axis=name, error_history=history)

    def _supervise(self, inputs: Inputs) -> None:
        """Looks for drives that cannot be trusted in groups that are enabled."""
        following = np.abs(self._demand_before - self.actual_position) > self._window
        for group in self.groups:
            if not group.following or group.state is GroupState.FAULT:
                continue
            if group.enabling:
                continue
            for axis, drive in enumerate(group.drives):
                why = drive.distrust()
                if why is None and following[group.first + axis] and drive.missed == 0 and not inputs.skipped:
                    error = float(self._demand_before[group.first + axis] - self.actual_position[group.first + axis])
                    why = f"following error {error:.4f} rad is over {self._window[group.first + axis]:.4f} rad"
                if why is not None and axis not in group.quick_stop:
                    self._fail_axis(group, axis, why)

    def _fail_axis(self, group: GroupMachine, axis: int, why: str) -> None:
        """FSTOP: the axis ramps down in its drive, the rest of the coordinated motion stops on its path."""
        drive = group.drives[axis]
        drive.rebooted = False
        group.quick_stop.add(axis)
        reason = f"{drive.axis.name}: {why}"
        details: dict[str, Any] = {"axis": drive.axis.name, "statusword": drive.statusword}
        if drive.emergency:
            details["error_code"] = drive.emergency.code
        self._say(EventKind.DRIVE_FAULT, reason, group, "error", **details)
        self._fail_group(group, reason)

    def _fail_group(self, group: GroupMachine, reason: str) -> None:
        group.fault = group.fault or reason
        motion = group.motion
        if motion is not None and group.state in (GroupState.MOVING, GroupState.STOPPING):
            self._slow(motion, Ending.FAILED, reason)
            return
        if motion is not None:
            self._end(motion, Ending.FAILED, reason)
        self._latch(group)

    def _latch(self, group: GroupMachine) -> None:
        """At rest with a fault: the drives are switched off, and only reset leads on."""
        group.goal, group.disable_at_rest, group.reason = Goal.DISABLED, False, group.fault
        self._enter(group, GroupState.FAULT)
        self._answer(group, ErrorCode.FAULTED, group.fault or "fault")

    def _react(self, inputs: Inputs) -> None:
        """Stops, lapsed leases, a lost front, too many skipped ticks, the end of the service."""
        if self._stop_counts is None:
            self._stop_counts = list(inputs.stop_counts)
        if inputs.skipped:
            self._on_skipped(inputs.skipped)
        for group in self.groups:
            stopped = inputs.stop_counts[group.index] != self._stop_counts[group.index]
            self._stop_counts[group.index] = inputs.stop_counts[group.index]
            motion = group.motion
            if motion is None:
                continue
            if stopped:
                self._stop(motion, "stop")
            elif inputs.stopping:
                self._stop(motion, "the service stops")
            elif inputs.leases_needed and not motion.slowing:
                if not inputs.front:
                    self._slow(motion, Ending.HELD, "front is gone")
                elif inputs.lease_until_ns[group.index] < inputs.now_ns:
                    self._slow(motion, Ending.HELD, "lease lapsed")
        if inputs.stopping and not self.shut_down:
            self._shut_down(inputs)

    def _on_skipped(self, skipped: int) -> None:
        if skipped > self.cell.missed_ticks_max:
            for group in self.groups:
                if group.following:
                    reason = f"{skipped} ticks skipped in a row, {self.cell.missed_ticks_max} are tolerated"
                    group.fault = group.fault or reason
                    group.quick_stop.update(range(len(group.drives)))
                    if group.motion is not None:
                        self._end(group.motion, Ending.FAILED, reason)
                    self._say(EventKind.TICKS_OVERRUN, reason, group, "error", skipped=skipped)
                    self._latch(group)
            return
        for motion in self.motions:
            if any(self._hold_on_missed[axis] for axis in motion.axes):
                self._slow(motion, Ending.HELD, "ticks skipped, and a drive holds when a tick is missing")

    def _shut_down(self, inputs: Inputs) -> None:
        self._deadline_ns = self._deadline_ns or inputs.now_ns + DISABLE_TIMEOUT_NS * 2
        for group in self.groups:
            if group.motion is None and group.goal is not Goal.DISABLED:
                self._disable(group, inputs.now_ns)
        done = all(group.motion is None and group.all_off for group in self.groups)
        self.shut_down = done or inputs.now_ns > self._deadline_ns

    # --- commands -----------------------------------------------------------------------------------------------

    def _command(self, command: GroupCommand | BeginCommand, inputs: Inputs) -> None:
        if inputs.stopping:
            self._refuse(command.ref, ErrorCode.UNAVAILABLE, "the service stops")
            return
        try:
            groups = [self.groups[i] for i in self.cell.members(command.group)]
        except KeyError:
            self._refuse(command.ref, ErrorCode.NOT_FOUND, f"no group {command.group}")
            return
        if isinstance(command, BeginCommand):
            self._begin(command)
        elif command.op == "enable":
            self._command_enable(command.ref, groups, inputs.now_ns)
        elif command.op == "disable":
            self._command_disable(command.ref, groups, inputs.now_ns)
        else:
            self._command_reset(command.ref, groups, inputs.now_ns)

    def _command_enable(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        for group in groups:
            if group.state is GroupState.FAULT:
                why = f"{group.name} is in fault ({group.reason}): reset it first"
                return self._refuse(ref, ErrorCode.FAULTED, why, group=group.name, reason=group.reason)
            if group.not_ready():
                why = f"{group.name} cannot be enabled: " + "; ".join(group.not_ready())
                return self._refuse(ref, ErrorCode.UNAVAILABLE, why, group=group.name, drives=group.not_ready())
            if group.faulted():
                why = f"{group.name} cannot be enabled: " + "; ".join(group.faulted()) + ": reset it first"
                return self._refuse(ref, ErrorCode.FAULTED, why, group=group.name, drives=group.faulted())
        for group in groups:
            if group.state is GroupState.DISABLED:
                self._enable(group, now_ns)
        self._owe(ref, [group for group in groups if group.enabling])
        return None

    def _enable(self, group: GroupMachine, now_ns: int) -> None:
        group.goal, group.deadline_ns, group.hold_until_ns = Goal.ENABLED, now_ns + ENABLE_TIMEOUT_NS, 0
        group.quick_stop.clear()
        for drive in group.drives:
            drive.rebooted = False
        # The drives are off and their brakes closed: what they show now is the target until they are enabled.
        self.current.position[group.axes] = self.actual_position[group.axes]

    def _command_disable(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        for group in groups:
            if group.motion is not None:
                self._stop(group.motion, "disable")
            if group.motion is not None:
                group.disable_at_rest = True
            elif group.goal is Goal.ENABLED:
                self._disable(group, now_ns)
        self._owe(ref, [group for group in groups if group.motion is not None or not group.all_off])

    def _disable(self, group: GroupMachine, now_ns: int) -> None:
        group.goal, group.deadline_ns, group.disable_at_rest = Goal.DISABLED, now_ns + DISABLE_TIMEOUT_NS, False
        if group.state is not GroupState.FAULT:
            self._enter(group, GroupState.DISABLED)

    def _command_reset(self, ref: int, groups: list[GroupMachine], now_ns: int) -> None:
        waiting = []
        for group in groups:
            if group.fault and group.state is not GroupState.FAULT:
                return self._refuse(ref, ErrorCode.WRONG_STATE, f"{group.name} is still stopping", group=group.name)
        for group in groups:
            if group.following:  # nothing to reset in a group that is enabled and well
                continue
            group.goal, group.deadline_ns = Goal.RESET, now_ns + RESET_TIMEOUT_NS
            waiting.append(group)
        self._owe(ref, waiting)
        return None

    def _begin(self, command: BeginCommand) -> None:
        try:
            self._loading.append((command, self._open_plan(command.slot, command.plan_id)))
        except PlanError as error:
            self._refuse(command.ref, ErrorCode.INTERNAL, str(error))

    def _load(self, inputs: Inputs) -> None:
        """Takes over plans piece by piece; those that are whole and may start, do."""
        loading, self._loading = self._loading, []
        for command, reader in loading:
            if not reader.advance():
                self._loading.append((command, reader))
                continue
            try:
                plan = reader.plan()
            except PlanError as error:
                self._refuse(command.ref, ErrorCode.INTERNAL, str(error))
                continue
            refusal = self._refusal(command, plan, inputs)
            if refusal is None:
                self._start(command, plan)
                self.replies.append((command.ref, None))
            else:
                self._refuse(command.ref, *refusal)

    def _refusal(self, command: BeginCommand, plan: Plan, inputs: Inputs) -> tuple[ErrorCode, str] | None:
        """Why a plan may not be played now. The last border: nothing is believed that can be checked."""
        members = self.cell.members(command.group)
        for position, member in enumerate(members):
            group = self.groups[member]
            if group.state is not GroupState.STANDSTILL or group.fault:
                code = ErrorCode.FAULTED if group.state is GroupState.FAULT else ErrorCode.WRONG_STATE
                return code, f"{group.name} is {group.state.label}, not standstill"
            if not inputs.leases_needed:
                continue
            if len(command.epochs) != len(members) or command.epochs[position] != inputs.lease_epochs[member]:
                return ErrorCode.LEASE_FENCED, f"the lease of {group.name} has changed hands"
            if command.stop_counts and command.stop_counts[position] != inputs.stop_counts[member]:
                return ErrorCode.WRONG_STATE, f"{group.name} was stopped meanwhile"
            if not inputs.front or inputs.lease_until_ns[member] < inputs.now_ns:
                return ErrorCode.LEASE_REQUIRED, f"the lease of {group.name} has lapsed"
        if tuple(plan.axes.tolist()) != self.cell.axis_indices(command.group):
            return ErrorCode.INTERNAL, f"plan {plan.plan_id} is not for the axes of {command.group}"
        if np.abs(plan.start - self.current.position[plan.axes]).max() > START_TOLERANCE:
            return ErrorCode.WRONG_STATE, f"plan {plan.plan_id} does not begin at the setpoint"
        return None

    def _start(self, command: BeginCommand, plan: Plan) -> None:
        members = self.cell.members(command.group)
        motion = Motion(plan, command.slot, command.group, members, self.cell.period)
        for member in members:
            self.groups[member].motion = motion
            self.groups[member].reason = None
            self._enter(self.groups[member], GroupState.MOVING)
        self._say(EventKind.MOVE_STARTED, f"move {plan.plan_id} of {command.group} starts", None, plan_id=plan.plan_id,
                  group_name=command.group, duration_s=plan.duration)  # fmt: skip

    # --- motions ------------------------------------------------------------------------------------------------

    def _stop(self, motion: Motion, reason: str) -> None:
        """Ends the move: on the path while it moves, at once where it is held."""
        if self.groups[motion.members[0]].state is GroupState.HELD:
            self._end(motion, Ending.STOPPED, reason)
        else:
            self._slow(motion, Ending.STOPPED, reason)

    def _slow(self, motion: Motion, ending: Ending, reason: str) -> None:
        if not motion.slow(ending, reason):
            return
        for member in motion.members:
            self._enter(self.groups[member], GroupState.STOPPING)
        self._say(EventKind.MOVE_STOPPING, f"move {motion.plan_id} slows: {reason}", None, plan_id=motion.plan_id,
                  reason=reason, path_s=motion.path_s, group_name=motion.group)  # fmt: skip

    def _end(self, motion: Motion, ending: Ending, reason: str | None) -> None:
        """The move is over; a member with a fault of its own is latched, the others stand."""
        status = _STATUS[ending]
        for member in motion.members:
            group = self.groups[member]
            group.motion = None
            if group.fault:
                self._latch(group)
            else:
                group.reason = reason
                self._enter(group, GroupState.STANDSTILL)
        severity: Severity = "error" if ending is Ending.FAILED else "info"
        what = f"move {motion.plan_id} of {motion.group} {status.value}" + (f": {reason}" if reason else "")
        self._say(EventKind.MOVE_ENDED, what, None, severity, plan_id=motion.plan_id, status=status.value,
                  reason=reason, group_name=motion.group)  # fmt: skip

    def _settle(self, motion: Motion) -> None:
        """A motion has come to rest."""
        if motion.ending is Ending.HELD and not motion.arrived:
            for member in motion.members:
                if self.groups[member].state is not GroupState.HELD:
                    self._enter(self.groups[member], GroupState.HELD)
                    self.groups[member].reason = motion.reason
            return
        succeeded = motion.ending in (Ending.SUCCEEDED, Ending.HELD)
        self._end(motion, Ending.SUCCEEDED if succeeded else motion.ending, None if succeeded else motion.reason)

    # --- goals --------------------------------------------------------------------------------------------------

    def _pursue(self, inputs: Inputs) -> None:
        """Moves groups on towards the goals that commands have set."""
        for group in self.groups:
            if group.disable_at_rest and group.motion is None:
                self._disable(group, inputs.now_ns)
            if group.enabling:
                self._pursue_enable(group, inputs.now_ns)
            elif group.goal is Goal.RESET:
                self._pursue_reset(group, inputs.now_ns)
            elif group.goal is Goal.DISABLED and group.owed:
                self._pursue_disable(group, inputs.now_ns)

    def _pursue_enable(self, group: GroupMachine, now_ns: int) -> None:
        if not group.all_enabled:
            group.hold_until_ns = 0
            lost = group.not_ready()
            if lost or now_ns > group.deadline_ns:
                slow = [f"{d.axis.name} is {d.state.label}" for d in group.drives if not d.state.name.startswith("OP")]
                self._give_up_enabling(group, "; ".join(lost or slow))
            return
        if not group.hold_until_ns:
            brake = max(drive.axis.drive.brake_release for drive in group.drives)
            group.hold_until_ns = now_ns + round(brake * 1e9)
        elif now_ns >= group.hold_until_ns:
            group.reason = None
            self._enter(group, GroupState.STANDSTILL)
            self._answer(group)

    def _give_up_enabling(self, group: GroupMachine, why: str) -> None:
        group.goal = Goal.DISABLED
        reason = f"{group.name} was not enabled: {why}"
        self._say(EventKind.DRIVE_FAULT, reason, group, "error")
        self._answer(group, ErrorCode.FAULTED, reason)

    def _pursue_reset(self, group: GroupMachine, now_ns: int) -> None:
        faulted = group.faulted()
        if not faulted and not group.not_ready():
            group.goal, group.reason, group.fault = Goal.DISABLED, None, None
            group.quick_stop.clear()
            for drive in group.drives:
                drive.rebooted, drive.emergency = False, None
            self._enter(group, GroupState.DISABLED)
            self._answer(group)
        elif now_ns > group.deadline_ns:
            group.goal = Goal.DISABLED
            why = faulted or group.not_ready()
            self._answer(group, ErrorCode.FAULTED, f"{group.name} could not be reset: " + "; ".join(why))

    def _pursue_disable(self, group: GroupMachine, now_ns: int) -> None:
        if group.all_off:
            self._answer(group)
        elif now_ns > group.deadline_ns:
            on = [drive.axis.name for drive in group.drives if drive.state.name.startswith("OPERATION")]
            self._answer(group, ErrorCode.INTERNAL, f"drives stay enabled: {', '.join(on)}")

    # --- setpoints ----------------------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Decides `upcoming`: motions move on by one tick, groups at rest keep their setpoint, others follow."""
        upcoming, current = self.upcoming, self.current
        upcoming.position[:] = current.position
        upcoming.velocity[:] = 0.0
        upcoming.acceleration[:] = 0.0
        upcoming.jerk[:] = 0.0
        for motion in self.motions:
            if self.groups[motion.members[0]].state is GroupState.HELD:
                continue
            q, v, a, j = motion.advance()
            axes = motion.axes
            upcoming.position[axes], upcoming.velocity[axes] = q, v
            upcoming.acceleration[axes], upcoming.jerk[axes] = a, j
            if motion.at_rest:
                self._settle(motion)
        for group in self.groups:
            motion_now = group.motion
            index = group.index
            if not group.following:
                upcoming.position[group.axes] = self.actual_position[group.axes]
            upcoming.group_state[index] = group.state
            upcoming.plan_id[index] = motion_now.plan_id if motion_now else 0
            upcoming.path_s[index] = motion_now.path_s if motion_now else 0.0
            upcoming.path_rate[index] = motion_now.rate if motion_now else 0.0
        upcoming.counts[:] = self.counts.to_counts(upcoming.position)  # the cast wraps as the 32-bit object does

    # --- saying -------------------------------------------------------------------------------------------------

    def _enter(self, group: GroupMachine, state: GroupState) -> None:
        if group.state is state:
            return
        before, group.state, self.changed = group.state, state, True
        severity: Severity = "error" if state is GroupState.FAULT else "info"
        self._say(EventKind.GROUP_STATE, f"{group.name}: {before.label} -> {state.label}", group, severity,
                  before=before.label, after=state.label, reason=group.reason)  # fmt: skip

    def _say(
        self, kind: EventKind, message: str, group: GroupMachine | None, severity: Severity = "info", **details: Any
    ) -> None:
        name = group.name if group else details.pop("group_name", None)
        self.happenings.append(Happening(kind, message, name, severity, details))

    def _owe(self, ref: int, groups: list[GroupMachine]) -> None:
        """Answers now where nothing is left to do, else when the last group is done."""
        if not groups:
            self.replies.append((ref, None))
        for group in groups:
            group.owed.append(ref)

    def _answer(self, group: GroupMachine, code: ErrorCode | None = None, message: str = "") -> None:
        owed, group.owed = group.owed, []
        for ref in owed:
            others = [other for other in self.groups if ref in other.owed]
            if code is not None:
                for other in others:
                    other.owed.remove(ref)
                self._refuse(ref, code, message, group=group.name)
            elif not others:
                self.replies.append((ref, None))

    def _refuse(self, ref: int, code: ErrorCode, message: str, **details: Any) -> None:
        self.replies.append((ref, ErrorBody(code=code, message=message, details=details)))
