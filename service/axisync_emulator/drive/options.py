"""Modes (0x6060) and option codes: how a drive stops (CiA 402-2, objects 0x605A to 0x605E and 0x6007)."""

from enum import Enum, IntEnum


class Mode(IntEnum):
    """0x6060: the modes of operation that this drive has."""

    NONE = 0
    HOMING = 6
    CYCLIC_SYNCHRONOUS_POSITION = 8


class Ramp(Enum):
    """How the motion ends."""

    COAST = "torque off, the brake stops it"
    SLOW_DOWN = "0x6084"
    QUICK_STOP = "0x6085"


class Abort(IntEnum):
    """0x6007: what a broken connection means."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


# Code 3 of 0x605A is a stop at the current limit, for which this drive takes the quick-stop ramp.
_BASIC = {0: Ramp.COAST, 1: Ramp.SLOW_DOWN, 2: Ramp.QUICK_STOP}
_BRIEF = {0: Ramp.COAST, 1: Ramp.SLOW_DOWN}
OPTIONS: dict[int, dict[int, Ramp]] = {
    0x605A: {
        **_BASIC, 3: Ramp.QUICK_STOP, 5: Ramp.SLOW_DOWN, 6: Ramp.QUICK_STOP, 7: Ramp.QUICK_STOP,
    },
    0x605B: _BRIEF,
    0x605C: _BRIEF,
    0x605D: {1: Ramp.SLOW_DOWN, 2: Ramp.QUICK_STOP},
    0x605E: _BASIC,
}  # fmt: skip
"""Object -> supported codes -> ramp."""

STAYS_IN_QUICK_STOP = frozenset({5, 6, 7})
"""Codes of 0x605A after which the drive remains in quick stop active."""
