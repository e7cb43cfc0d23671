"""The controller's status, which front and the supervisor read from shared memory."""

from pydantic import TypeAdapter

from axisync_schemas.internal import (
    CONTROLLER_STATUS,
    BusStatus,
    ControllerStatus,
    DriveStatus,
    GroupStatus,
)
from axisync_schemas.memory import Mailbox
from axisync_service.bus.port import BusPort
from axisync_service.canopen.emcy import describe
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.step import Core

AT_ONCE = 3
"""Drives looked at in one tick: as long as writing the rest takes."""
_DRIVE_STATUS = TypeAdapter(DriveStatus)
_NO_DRIVES = b'"drives":[]'
"""Where the drives' parts go. Within a text its quotation marks would be escaped, so it stands there once."""


class StatusWriter:
    """Rewrites the mailbox, now and then. What it says of the drives is gathered one after the other, a few each tick,
    as all at once take half as long as the rest of a cycle.
    """

    def __init__(self, mailbox: Mailbox, drives: list[DriveLink], interval_ticks: int) -> None:
        """`interval_ticks`: between two calls of `write` when nothing happens."""
        self._mailbox, self._drives = mailbox, drives
        self._at_once = max(AT_ONCE, -(-len(drives) // interval_ticks))
        self._told = [b""] * len(drives)
        self._next = 0
        self._whole = True
        self._homed_changes = 0

    def renew(self) -> None:
        """Something has happened: the next status tells what is so now, of every drive."""
        self._whole = True

    def look(self) -> None:
        """At the drives whose turn it is. Call once a tick."""
        for _ in range(self._at_once):
            if self._next < len(self._drives):
                self._look(self._next)
                self._next += 1

    def _look(self, index: int) -> None:
        self._told[index] = _DRIVE_STATUS.dump_json(_drive_status(self._drives[index]))

    def write(self, core: Core, ports: list[BusPort], loads: list[float], tick: int, now_ns: int, skipped: int) -> None:
        """The status now."""
        if self._whole or core.homed_changes != self._homed_changes:
            self._homed_changes = core.homed_changes
            self._next = 0
        for index in range(self._next, len(self._drives)):
            self._look(index)
        self._whole, self._next = False, 0
        status = ControllerStatus(
            tick=tick,
            now_ns=now_ns,
            groups=tuple(
                GroupStatus(
                    override=group.override,
                    state=int(group.state),
                    plan_id=group.motion.plan_id if group.motion else 0,
                    slot=group.motion.slot if group.motion else -1,
                    reason=group.fault or group.reason,
                    ready=group.ready,
                )
                for group in core.groups
            ),
            drives=(),
            buses=tuple(
                BusStatus(
                    state="up" if port.failure is None else f"down: {port.failure}",
                    load=load,
                    sent=port.sent,
                    received=port.received,
                    lost=port.lost,
                )
                for port, load in zip(ports, loads, strict=True)
            ),
            skipped_ticks=skipped,
            homed_changes=core.homed_changes,
        )
        text = CONTROLLER_STATUS.dump_json(status)
        self._mailbox.write(text.replace(_NO_DRIVES, b'"drives":[%b]' % b",".join(self._told), 1))


def _drive_status(drive: DriveLink) -> DriveStatus:
    health, emergency = drive.health, drive.emergency
    return DriveStatus(
        state=int(drive.state),
        nmt=int(drive.nmt),
        statusword=drive.statusword,
        error_code=emergency.code if emergency else 0,
        error=drive.bring_up.failure or (describe(emergency.code) if emergency else None),
        velocity=drive.velocity,
        torque=drive.torque,
        temperature=health.temperature.value if health.temperature else None,
        voltage=health.voltage.value if health.voltage else None,
        safe_torque_off=health.safe_torque_off.value if health.safe_torque_off else None,
        homed=drive.homed if drive.axis.drive.homing else None,
        serial=drive.bring_up.serial,
    )
