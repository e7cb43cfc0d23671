"""Enumerations shared by wire, log and shared memory. Numbers are part of the log format."""

from enum import IntEnum, StrEnum


class GroupState(IntEnum):
    """State of a group; the names are PLCopen's where they agree."""

    DISABLED = 0
    STANDSTILL = 1
    MOVING = 2
    HELD = 3
    STOPPING = 4
    HOMING = 5
    JOGGING = 6
    FAULT = 7

    @property
    def label(self) -> str:
        """The name on the wire: lower case."""
        return self.name.lower()


class DriveState(IntEnum):
    """CiA 402-2, figure 'state machine'; UNKNOWN until the first statusword."""

    UNKNOWN = 0
    NOT_READY_TO_SWITCH_ON = 1
    SWITCH_ON_DISABLED = 2
    READY_TO_SWITCH_ON = 3
    SWITCHED_ON = 4
    OPERATION_ENABLED = 5
    QUICK_STOP_ACTIVE = 6
    FAULT_REACTION_ACTIVE = 7
    FAULT = 8

    @property
    def label(self) -> str:
        """The name on the wire: lower case."""
        return self.name.lower()


class NmtState(IntEnum):
    """CiA 301, 7.2.8.3.2.2: the state byte of a heartbeat; UNKNOWN before the first and after a lost one."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F
    UNKNOWN = 0xFF

    @property
    def label(self) -> str:
        """The name on the wire: lower case."""
        return self.name.lower()


class LateCause(IntEnum):
    """Why a tick of the cycle was late; NONE: it was not."""

    NONE = 0
    SCHEDULER = 1
    OWN_CODE = 2
    BUS = 3

    @property
    def label(self) -> str:
        """The name on the wire: lower case."""
        return self.name.lower()


class RecorderState(IntEnum):
    """`memory.Word.RECORDER_STATE`."""

    NOT_STARTED = 0
    WRITING = 1
    FAILING = 2

    @property
    def label(self) -> str:
        """The name in `state`: lower case, in words."""
        return self.name.lower().replace("_", " ")


class MoveStatus(StrEnum):
    """Where a move is in its life."""

    EXECUTING = "executing"
    HELD = "held"
    SUCCEEDED = "succeeded"
    STOPPED = "stopped"
    FAILED = "failed"


class Phase(IntEnum):
    """The service's phase, a word of shared memory written by the supervisor alone."""

    RUNNING = 0
    STOPPING = 1
    """Moves are refused, groups are stopped, drives disabled."""
    CLOSING = 2
    """The drives are disabled: recorder drains, front closes Zenoh."""
