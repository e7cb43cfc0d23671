"""Watches the drives: what was lost, what they report, how far bring-ups are, and whether they can be trusted."""

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.enumerations import GroupState
from axisync_schemas.events import EventKind
from axisync_service.canopen.emcy import describe, describe_register
from axisync_service.drives.bring_up import Phase
from axisync_service.drives.link import DriveLink
from axisync_service.mapper.counts import CountMap
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.motions import Motions
from axisync_service.motion_controller.voice import Voice

FROZEN_S = 0.010
FROZEN_COUNTS = 20
"""An actual position that has not changed for so long, while its demand has gone so far, is not believed."""

_READY = Phase.READY
"""Python 3.11 takes 0.2 us to look a member up, too long for each drive and tick."""


class Watch:
    """Eyes on all drives.

    Attributes:
        actual_position: [n] rad; statuswords: [n].
        demand_before: [n] the demand in force at the SYNC at which the newest samples were taken, rad.
        homes_lost: how often an axis was found to be homed no longer.
    """

    def __init__(self, groups: list[GroupMachine], drives: list[DriveLink], counts: CountMap, voice: Voice) -> None:
        self._groups, self._drives, self._counts, self._voice = groups, drives, counts, voice
        self.actual_position = np.zeros(len(drives))
        self.statuswords: NDArray[np.uint32] = np.zeros(len(drives), np.uint32)
        self.demand_before = np.zeros(len(drives))
        self.homes_lost = 0
        self._window = np.array([drive.axis.drive.following_error_max for drive in drives])
        self._frozen_travel = [FROZEN_COUNTS / abs(drive.axis.drive.counts_per_rad) for drive in drives]
        self._frozen_ticks = max(3, round(FROZEN_S / drives[0].cell.period))
        self._frozen_at: list[float | None] = [None] * len(drives)
        """Demand when an actual position began to repeat itself, rad."""
        self._failures: dict[str, str] = {}
        self._gap_before = False

    def observe(self, now_ns: int) -> None:
        """Actual positions, lost drives, emergencies, and the progress of bring-ups."""
        for group in self._groups:
            for drive in group.drives:
                lost = drive.end_of_read(now_ns)
                if lost is not None:
                    self._voice.say(EventKind.DRIVE_LOST, lost, group.name, "error", axis=drive.axis.name)
                if drive.new_emergencies:
                    self._say_emergencies(group, drive)
                if drive.channel.busy:
                    drive.channel.step(drive.bring_up.sdo)
                elif drive.bring_up.phase is not _READY:
                    self._bring_up(group, drive, now_ns)
        actual = np.array([drive.actual for drive in self._drives], dtype=np.int64)
        self.actual_position = self._counts.to_position(actual)
        self.statuswords[:] = [drive.statusword for drive in self._drives]

    def _say_emergencies(self, group: GroupMachine, drive: DriveLink) -> None:
        for emergency in drive.new_emergencies:
            self._voice.say(
                EventKind.EMERGENCY,
                f"{drive.axis.name}: EMCY 0x{emergency.code:04X}, {emergency.words} "
                f"(register: {describe_register(emergency.register)})",
                group.name,
                "error",
                axis=drive.axis.name,
                error_code=emergency.code,
                error_register=emergency.register,
                manufacturer=emergency.manufacturer.hex(),
            )
        drive.new_emergencies.clear()

    def _bring_up(self, group: GroupMachine, drive: DriveLink, now_ns: int) -> None:
        """One step on. Says each failure that differs from the last once, and when the drive is ready."""
        bring_up, name = drive.bring_up, drive.axis.name
        bring_up.step(now_ns)
        why = drive.home_lost()
        if why is not None:
            self.homes_lost += 1
            text = f"{name} must be homed again: {why}"
            self._voice.say(EventKind.HOME_LOST, text, group.name, "warning", axis=name)
        if bring_up.ready:
            self._failures.pop(name, None)
            history = [f"0x{code:04X} {describe(code)}" for code in bring_up.history]
            text = f"{name} is operational" + (f", it remembers: {', '.join(history)}" if history else "")
            self._voice.say(EventKind.DRIVE_READY, text, group.name, axis=name, error_history=history)
        elif bring_up.failure is not None and self._failures.get(name) != bring_up.failure:
            self._failures[name] = bring_up.failure
            self._voice.say(EventKind.BRING_UP_FAILED, bring_up.failure, group.name, "error", axis=name)

    def supervise(self, motions: Motions, skipped: int) -> None:
        """Fails the axes of enabled groups whose drives cannot be trusted any longer.

        After skipped ticks the next two samples are no measure of that: a step over the gap shows at the tick after.
        """
        gap, self._gap_before = skipped > 0 or self._gap_before, skipped > 0
        error = self.demand_before - self.actual_position
        too_far = (np.abs(error) > self._window).tolist()
        for group in self._groups:
            if not group.following or group.enabling or group.state is GroupState.FAULT:
                self._frozen_at[group.axes] = [None] * len(group.drives)
                continue
            for axis, drive in enumerate(group.drives):
                index = group.first + axis
                if gap:
                    drive.jump = 0
                why = drive.distrust()
                if why is None and drive.same:
                    why = self._frozen(index, drive)
                if why is None and too_far[index] and not (drive.missed or drive.adrift or gap):
                    why = f"following error {error[index]:.4f} rad is over {self._window[index]:.4f} rad"
                if why is not None and axis not in group.quick_stop:
                    motions.fail_axis(group, axis, why)

    def _frozen(self, index: int, drive: DriveLink) -> str | None:
        """Samples are on time but all the same, although the demand has moved on since they began to be."""
        demand, began = float(self.demand_before[index]), self._frozen_at[index]
        if began is None or drive.same == 1 or drive.adrift:
            self._frozen_at[index] = demand
        elif drive.same >= self._frozen_ticks and abs(demand - began) > self._frozen_travel[index]:
            return f"its position has not changed for {drive.same} ticks while its target moved"
        return None
