"""The CiA 402 state machine as tables: statusword to state, and the controlword that leads to a goal."""

from enum import IntEnum

from axisync_schemas.enumerations import DriveState


class Controlword(IntEnum):
    """Commands of CiA 402-2, table 'device control commands'; bit 7 is the fault reset."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080
    START_HOMING = 0x001F
    """Enable operation with bit 4: in homing mode its rising edge starts, and it must stay."""
    HALT = 0x010F


class Status(IntEnum):
    """Bits of the statusword that are read one by one. Not an IntFlag: its operators cost a microsecond each."""

    VOLTAGE_ENABLED = 1 << 4
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT = 1 << 11
    FOLLOWS_COMMAND = 1 << 12
    """In csp: the drive follows the target position."""
    FOLLOWING_ERROR = 1 << 13
    HOMING_ATTAINED = 1 << 12
    """In homing mode."""
    HOMING_ERROR = 1 << 13


_STATES = (
    # mask, value, state: CiA 402-2, table 'state coding'
    (0x4F, 0x00, DriveState.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, DriveState.FAULT),
)


def _decode(low: int) -> DriveState:
    for mask, value, state in _STATES:
        if low & mask == value:
            return state
    return DriveState.UNKNOWN


_BY_LOW_BYTE = tuple(_decode(low) for low in range(256))


def state_of(statusword: int) -> DriveState:
    """The state that a statusword shows; UNKNOWN for codes the profile does not name."""
    return _BY_LOW_BYTE[statusword & 0xFF]


_TOWARDS_ENABLED = dict.fromkeys(DriveState, Controlword.DISABLE_VOLTAGE) | {
    DriveState.SWITCH_ON_DISABLED: Controlword.SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: Controlword.SWITCH_ON,
    DriveState.SWITCHED_ON: Controlword.ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: Controlword.ENABLE_OPERATION,
}


def towards_enabled(state: DriveState) -> Controlword:
    """The next command on the way to operation enabled; from any other state, no voltage."""
    return _TOWARDS_ENABLED[state]
