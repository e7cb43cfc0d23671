"""The decisions of one tick: a pure function of state and inputs. Reads no clock, sends nothing.

At tick k the setpoints of t[k+1] are decided. `advance_skipped` moves motions on over ticks that were not executed.
"""

from collections.abc import Mapping

import numpy as np

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.events import EventKind
from axisync_schemas.internal import Command
from axisync_service.drives.link import DriveLink
from axisync_service.mapper.counts import CountMap
from axisync_service.motion_controller.commands import Commands, OpenPlan
from axisync_service.motion_controller.demand import Inputs, Setpoints
from axisync_service.motion_controller.foreign import Foreign, Notice
from axisync_service.motion_controller.groups import DISABLE_TIMEOUT_NS, Goal, GroupMachine
from axisync_service.motion_controller.motions import Motions
from axisync_service.motion_controller.player import Ending
from axisync_service.motion_controller.rounds import Rounds
from axisync_service.motion_controller.voice import Voice
from axisync_service.motion_controller.watch import Watch

_STILL = (GroupState.DISABLED, GroupState.STANDSTILL, GroupState.HELD, GroupState.FAULT)


class Core:
    """Groups, motions and their setpoints.

    Attributes:
        current: setpoints in force at the present tick; upcoming: those of the next, which the RPDOs carry.
        voice: what to say; watch: what the drives show; foreign: frames of others.
        shut_down: the service stops, and every drive is off.
    """

    def __init__(self, cell: Cell, open_plan: OpenPlan, homed: Mapping[str, int] | None = None) -> None:
        """`homed`: axes that an earlier run homed, with the serial numbers of their drives."""
        self.cell = cell
        self.drives = [DriveLink(cell, axis) for axis in cell.axes]
        self.groups = [self._group(index, name) for index, name in enumerate(cell.group_names)]
        self.voice = Voice(self.groups)
        self.motions = Motions(self.groups, self.voice)
        self._counts = CountMap(cell.axes)
        self.watch = Watch(self.groups, self.drives, self._counts, self.voice)
        self._commands = Commands(cell, self.groups, self.motions, self.voice, open_plan)
        self.foreign = Foreign(cell, self.groups)
        self._rounds = Rounds(cell, self.groups, self.voice)
        for drive in self.drives:
            if homed is not None and drive.axis.name in homed:
                drive.adopt_home(homed[drive.axis.name])
        n, g = len(cell.axes), len(self.groups)
        self.current, self.upcoming = Setpoints.zeros(n, g), Setpoints.zeros(n, g)
        self.shut_down = False
        self._stop_counts: list[int] | None = None
        self._hold_on_missed = np.array([axis.drive.on_missed == "hold" for axis in cell.axes])
        self._shut_down_by_ns = 0

    def _group(self, index: int, name: str) -> GroupMachine:
        axes = self.cell.axis_indices(name)
        first, last = axes[0], axes[-1] + 1
        return GroupMachine(index, name, first, last, self.drives[first:last])

    # --- the tick -----------------------------------------------------------------------------------------------

    def begin_tick(self) -> None:
        """What was upcoming is in force now."""
        self.current, self.upcoming = self.upcoming, self.current

    def step(self, inputs: Inputs, commands: list[Command]) -> None:
        """Decides one executed tick."""
        self.voice.changed = False
        self.watch.observe(inputs.now_ns)
        self.watch.supervise(self.motions, inputs.skipped)
        self._react(inputs)
        for command in commands:
            self._commands.take(command, inputs)
        self._commands.load(inputs, self.current.position)
        self._commands.pursue(inputs.now_ns)
        self._rounds.visit(inputs.tick)
        self._advance()

    def advance_skipped(self) -> None:
        """After `begin_tick` of a tick that is not executed: motions run on, nothing is decided."""
        self._advance()

    @property
    def homed_changes(self) -> int:
        """Grows whenever an axis was homed, or is no longer."""
        return self._commands.homing.changes + self.watch.homes_lost

    @property
    def still(self) -> bool:
        """Nothing moves and nothing is being enabled: the time for house-keeping."""
        return all(group.state in _STILL and not group.enabling for group in self.groups)

    # --- reacting -----------------------------------------------------------------------------------------------

    def _react(self, inputs: Inputs) -> None:
        """Skipped ticks, stops, lapsed leases, a lost front, the end of the service."""
        if inputs.skipped:
            self._on_skipped(inputs.skipped)
        for notice in self.foreign.notice(inputs.tick):
            self._on_foreign(notice, inputs.now_ns)
        before = self._stop_counts or inputs.stop_counts
        self._stop_counts = inputs.stop_counts
        for group in self.groups:
            motion = group.motion
            if group.homing is not None:
                stopped = inputs.stop_counts[group.index] != before[group.index]
                self._commands.homing.react(group, inputs, stopped)
            if motion is None:
                continue
            if inputs.stop_counts[group.index] != before[group.index]:
                self.motions.stop(motion, "stop")
            elif inputs.stopping:
                self.motions.stop(motion, "the service stops")
            elif inputs.leases_needed and not motion.slowing:
                if not inputs.front:
                    self.motions.hold(motion, "front is gone")
                elif inputs.lease_until_ns[group.index] < inputs.now_ns:
                    self.motions.hold(motion, "lease lapsed")
        self.motions.expire(inputs.now_ns)
        if inputs.stopping and not self.shut_down:
            self._shut_down(inputs.now_ns)

    def _on_foreign(self, notice: Notice, now_ns: int) -> None:
        """Somebody else talks to the drives of a bus: what moves there comes to rest on its path."""
        if notice.news:
            self.voice.say(EventKind.FOREIGN_FRAMES, notice.why, None, "error", bus=notice.bus)
        for group in notice.groups:
            if group.homing is not None and group.homing.failure is None:
                self._commands.homing.stop(group, notice.why, now_ns)
            elif group.motion is not None and group.state in (GroupState.MOVING, GroupState.JOGGING):
                self.motions.slow(group.motion, Ending.FAILED, notice.why)

    def _on_skipped(self, skipped: int) -> None:
        most = self.cell.missed_ticks_max
        if skipped > most:
            reason = f"{skipped} ticks skipped in a row, {most} are tolerated"
            for group in self.groups:
                if group.following:
                    self.voice.say(EventKind.TICKS_OVERRUN, reason, group.name, "error", skipped=skipped)
                    self.motions.abort(group, reason)
            return
        for motion in self.motions.all():
            if self._hold_on_missed[motion.axes].any():
                why = "ticks skipped, and a drive holds when a tick is missing"
                self.motions.hold(motion, why)

    def _shut_down(self, now_ns: int) -> None:
        self._shut_down_by_ns = self._shut_down_by_ns or now_ns + 2 * DISABLE_TIMEOUT_NS
        for group in self.groups:
            if group.motion is None and group.homing is None and group.goal is not Goal.DISABLED:
                self._commands.switch_off(group, now_ns)
        done = all(group.motion is None and group.all_off for group in self.groups)
        self.shut_down = done or now_ns > self._shut_down_by_ns

    # --- setpoints ----------------------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Decides `upcoming`: motions move on by one tick, groups at rest keep their setpoint, others follow."""
        upcoming, current = self.upcoming, self.current
        self.watch.demand_before[:] = current.position
        upcoming.position[:] = current.position
        upcoming.rates.fill(0.0)
        for motion in self.motions.all():
            if self.groups[motion.members[0]].state is GroupState.HELD:
                continue
            relaxed = motion.relaxed_ticks
            q, v, a, j = motion.advance()
            self.motions.watch_rate(motion, relaxed)
            axes = motion.axes
            upcoming.position[axes], upcoming.velocity[axes] = q, v
            upcoming.acceleration[axes], upcoming.jerk[axes] = a, j
            if motion.at_rest:
                self.motions.settle(motion)
        for group in self.groups:
            if not group.following:  # With closed brakes, what the drives show is the target.
                upcoming.position[group.axes] = self.watch.actual_position[group.axes]
            elif group.homing is not None:
                for axis in group.homing.adopting:
                    upcoming.position[group.first + axis] = self.watch.actual_position[group.first + axis]
            self._describe(group, upcoming)
        upcoming.counts[:] = self._counts.to_counts(upcoming.position)  # the cast wraps as the 32-bit object does

    def _describe(self, group: GroupMachine, upcoming: Setpoints) -> None:
        motion, index = group.motion, group.index
        upcoming.group_state[index] = group.state
        upcoming.plan_id[index] = motion.plan_id if motion else 0
        upcoming.path_s[index] = motion.path_s if motion else 0.0
        upcoming.path_rate[index] = motion.rate if motion else 0.0
