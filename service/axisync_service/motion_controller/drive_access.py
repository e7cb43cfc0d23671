"""Carries out `drive`: one object of one drive read or written by SDO, while its group does not move."""

from collections.abc import Callable

from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import DriveCommand
from axisync_service.canopen.sdo import SdoError
from axisync_service.drives.bring_up import object_name
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.voice import Voice

_MOVING = frozenset({GroupState.MOVING, GroupState.STOPPING, GroupState.HOMING, GroupState.JOGGING})
SAFE_WHILE_ENABLED = frozenset({(0x1003, 0)})
"""Writes that do not touch how an enabled drive behaves: clearing the error history."""


class DriveAccess:
    """Maintenance of drives that are brought up."""

    def __init__(self, groups: list[GroupMachine], drives: list[DriveLink], voice: Voice) -> None:
        self._groups, self._drives, self._voice = groups, drives, voice

    def take(self, command: DriveCommand) -> None:
        """Begins, or refuses; answered when the drive has."""
        if not 0 <= command.axis < len(self._drives):
            return self._voice.refuse(command.ref, ErrorCode.NOT_FOUND, f"no axis {command.axis}")
        drive = self._drives[command.axis]
        group = next(group for group in self._groups if group.first <= command.axis < group.last)
        writes = command.data is not None or command.value is not None
        name = drive.axis.name
        if group.state in _MOVING or group.enabling:
            why = f"{group.name} is {group.state.label}: objects of {name} are reached while it stands still"
            return self._voice.refuse(command.ref, ErrorCode.BUSY, why, group=group.name, state=group.state.label)
        if writes and group.following and (command.index, command.sub) not in SAFE_WHILE_ENABLED:
            why = f"{group.name} is enabled: disable it before an object of {name} is written"
            return self._voice.refuse(command.ref, ErrorCode.WRONG_STATE, why, group=group.name)
        if not drive.bring_up.ready:
            why = drive.bring_up.failure or f"axis {name} is still being brought up"
            return self._voice.refuse(command.ref, ErrorCode.UNAVAILABLE, why, axis=name)
        return self._begin(command, drive)

    def _begin(self, command: DriveCommand, drive: DriveLink) -> None:
        index, sub, channel = command.index, command.sub, drive.channel

        def read_back(_: bytes) -> None:
            channel.read(index, sub, self._then(command, drive, "reading", self._answer(command)))

        def write(data: bytes) -> None:
            channel.write(index, sub, data, self._then(command, drive, "writing", read_back))

        def sized(found: bytes) -> None:
            try:
                value = command.value or 0
                write(value.to_bytes(len(found), "little", signed=value < 0))
            except OverflowError:
                why = f"{object_name(index, sub)} has {len(found)} bytes, {command.value} does not fit"
                self._voice.refuse(command.ref, ErrorCode.INVALID_REQUEST, why)

        if command.data is not None:
            write(bytes.fromhex(command.data))
        elif command.value is not None:
            channel.read(index, sub, self._then(command, drive, "reading", sized))
        else:
            read_back(b"")

    def _answer(self, command: DriveCommand) -> Callable[[bytes], None]:
        return lambda found: self._voice.done(command.ref, found.hex())

    def _then(
        self, command: DriveCommand, drive: DriveLink, doing: str, go_on: Callable[[bytes], None]
    ) -> Callable[[bytes | SdoError], None]:
        """Goes on with an answer; refuses with the abort code in words."""

        def take(answer: bytes | SdoError) -> None:
            if isinstance(answer, bytes):
                return go_on(answer)
            place = drive.axis.drive
            where = f"axis {drive.axis.name} (bus {place.bus}, node {place.node_id})"
            why = f"{where}: {doing} {object_name(command.index, command.sub)}: {answer}"
            return self._voice.refuse(command.ref, ErrorCode.INVALID_REQUEST, why, abort=f"0x{answer.abort:08X}")

        return take
