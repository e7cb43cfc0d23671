"""The drive's state machine as a table: CiA 402-2, 'Finite state automaton', transitions 0 to 16."""

from enum import Enum, IntEnum
from typing import NamedTuple


class State(IntEnum):
    """The number is the state's pattern in the statusword (under `STATE_MASK`)."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


STATE_MASK = 0x6F


class Command(Enum):
    """What a controlword asks for."""

    SHUTDOWN = "shutdown"
    SWITCH_ON = "switch on"
    ENABLE_OPERATION = "enable operation"
    DISABLE_VOLTAGE = "disable voltage"
    QUICK_STOP = "quick stop"
    FAULT_RESET = "fault reset"


FAULT_RESET_BIT = 0x80
HALT_BIT = 0x100

# Mask and value of bits 0-3 and 7. "Disable operation" is the bit pattern of "switch on".
_COMMANDS = (
    (0x82, 0x00, Command.DISABLE_VOLTAGE),
    (0x86, 0x02, Command.QUICK_STOP),
    (0x87, 0x06, Command.SHUTDOWN),
    (0x8F, 0x07, Command.SWITCH_ON),
    (0x8F, 0x0F, Command.ENABLE_OPERATION),
)


def command_of(controlword: int, previous: int) -> Command | None:
    """What the controlword commands, after `previous`; a fault reset is a rising edge of bit 7, and only that."""
    if controlword & FAULT_RESET_BIT:
        return None if previous & FAULT_RESET_BIT else Command.FAULT_RESET
    return next(command for mask, value, command in _COMMANDS if controlword & mask == value)


class Stop(Enum):
    """What must have happened to the motion before a transition is complete."""

    NONE = "none"
    AT_ONCE = "torque off"
    SHUTDOWN = "0x605B"
    DISABLE_OPERATION = "0x605C"
    QUICK_STOP = "0x605A"
    FAULT = "0x605E"


class Transition(NamedTuple):
    """A row of the table."""

    number: int
    target: State
    stop: Stop = Stop.NONE


_S, _C = State, Command
TRANSITIONS: dict[tuple[State, Command], Transition] = {
    (_S.SWITCH_ON_DISABLED, _C.SHUTDOWN): Transition(2, _S.READY_TO_SWITCH_ON),
    (_S.READY_TO_SWITCH_ON, _C.SWITCH_ON): Transition(3, _S.SWITCHED_ON),
    (_S.READY_TO_SWITCH_ON, _C.ENABLE_OPERATION): Transition(3, _S.SWITCHED_ON),
    (_S.READY_TO_SWITCH_ON, _C.QUICK_STOP): Transition(7, _S.SWITCH_ON_DISABLED),
    (_S.READY_TO_SWITCH_ON, _C.DISABLE_VOLTAGE): Transition(7, _S.SWITCH_ON_DISABLED),
    (_S.SWITCHED_ON, _C.ENABLE_OPERATION): Transition(4, _S.OPERATION_ENABLED),
    (_S.SWITCHED_ON, _C.SHUTDOWN): Transition(6, _S.READY_TO_SWITCH_ON),
    (_S.SWITCHED_ON, _C.QUICK_STOP): Transition(10, _S.SWITCH_ON_DISABLED),
    (_S.SWITCHED_ON, _C.DISABLE_VOLTAGE): Transition(10, _S.SWITCH_ON_DISABLED),
    (_S.OPERATION_ENABLED, _C.SWITCH_ON): Transition(5, _S.SWITCHED_ON, Stop.DISABLE_OPERATION),
    (_S.OPERATION_ENABLED, _C.SHUTDOWN): Transition(8, _S.READY_TO_SWITCH_ON, Stop.SHUTDOWN),
    (_S.OPERATION_ENABLED, _C.DISABLE_VOLTAGE): Transition(9, _S.SWITCH_ON_DISABLED, Stop.AT_ONCE),
    (_S.OPERATION_ENABLED, _C.QUICK_STOP): Transition(11, _S.QUICK_STOP_ACTIVE, Stop.QUICK_STOP),
    (_S.QUICK_STOP_ACTIVE, _C.DISABLE_VOLTAGE): Transition(12, _S.SWITCH_ON_DISABLED, Stop.AT_ONCE),
    (_S.QUICK_STOP_ACTIVE, _C.ENABLE_OPERATION): Transition(16, _S.OPERATION_ENABLED),
    (_S.FAULT, _C.FAULT_RESET): Transition(15, _S.SWITCH_ON_DISABLED),
}
"""Transitions that a command causes. 0, 1, 13 and 14 are the drive's own; 12 also follows a finished quick stop."""

POWERED = frozenset({State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE})
"""States with torque on the motor."""
