"""Watches the drives: what was lost, what they report, how far bring-ups are, and whether they can be trusted."""

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.enumerations import GroupState
from axisync_schemas.events import EventKind
from axisync_service.canopen.emcy import describe
from axisync_service.drives.link import DriveLink
from axisync_service.mapper.counts import CountMap
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.motions import Motions
from axisync_service.motion_controller.voice import Voice


class Watch:
    """Eyes on all drives.

    Attributes:
        actual_position: [n] rad; statuswords: [n].
        demand_before: [n] the demand in force at the SYNC at which the newest samples were taken, rad.
    """

    def __init__(self, groups: list[GroupMachine], drives: list[DriveLink], counts: CountMap, voice: Voice) -> None:
        self._groups, self._drives, self._counts, self._voice = groups, drives, counts, voice
        self.actual_position = np.zeros(len(drives))
        self.statuswords: NDArray[np.uint32] = np.zeros(len(drives), np.uint32)
        self.demand_before = np.zeros(len(drives))
        self._window = np.array([drive.axis.drive.following_error_max for drive in drives])
        self._failures: dict[str, str] = {}

    def observe(self, now_ns: int) -> None:
        """Actual positions, lost drives, emergencies, and the progress of bring-ups."""
        for group in self._groups:
            for drive in group.drives:
                lost = drive.end_of_read(now_ns)
                if lost is not None:
                    self._voice.say(EventKind.DRIVE_LOST, lost, group.name, "error", axis=drive.axis.name)
                if drive.new_emergencies:
                    self._say_emergencies(group, drive)
                if not drive.bring_up.ready:
                    drive.bring_up.step(now_ns)
                    self._say_bring_up(group, drive)
        actual = np.array([drive.actual for drive in self._drives], dtype=np.int64)
        self.actual_position = self._counts.to_position(actual)
        self.statuswords[:] = [drive.statusword for drive in self._drives]

    def _say_emergencies(self, group: GroupMachine, drive: DriveLink) -> None:
        for emergency in drive.new_emergencies:
            self._voice.say(
                EventKind.EMERGENCY,
                f"{drive.axis.name}: EMCY 0x{emergency.code:04X}, {emergency.words}",
                group.name,
                "error",
                axis=drive.axis.name,
                error_code=emergency.code,
                error_register=emergency.register,
                manufacturer=emergency.manufacturer.hex(),
            )
        drive.new_emergencies.clear()

    def _say_bring_up(self, group: GroupMachine, drive: DriveLink) -> None:
        """Once for each failure that differs from the last, and when the drive is ready."""
        bring_up, name = drive.bring_up, drive.axis.name
        if bring_up.failure is not None and self._failures.get(name) != bring_up.failure:
            self._failures[name] = bring_up.failure
            self._voice.say(EventKind.BRING_UP_FAILED, bring_up.failure, group.name, "error", axis=name)
        elif bring_up.ready:
            self._failures.pop(name, None)
            history = [f"0x{code:04X} {describe(code)}" for code in bring_up.history]
            text = f"{name} is operational" + (f", it remembers: {', '.join(history)}" if history else "")
            self._voice.say(EventKind.DRIVE_READY, text, group.name, axis=name, error_history=history)

    def supervise(self, motions: Motions, skipped: int) -> None:
        """Fails the axes of enabled groups whose drives cannot be trusted any longer."""
        error = self.demand_before - self.actual_position
        too_far = np.abs(error) > self._window
        for group in self._groups:
            if not group.following or group.enabling or group.state is GroupState.FAULT:
                continue
            for axis, drive in enumerate(group.drives):
                index = group.first + axis
                why = drive.distrust()
                if why is None and too_far[index] and drive.missed == 0 and not skipped:
                    why = f"following error {error[index]:.4f} rad is over {self._window[index]:.4f} rad"
                if why is not None and axis not in group.quick_stop:
                    motions.fail_axis(group, axis, why)
