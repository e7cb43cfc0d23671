"""Which object is which quantity of the drive: read live by SDO and PDO alike, and which values objects may take."""

from collections.abc import Callable
from dataclasses import dataclass

from canopen import SdoAbortedError

from axisync_emulator.drive.emergency import INVALID, Emergencies
from axisync_emulator.drive.health import Health
from axisync_emulator.drive.homing import METHODS
from axisync_emulator.drive.inputs import Inputs
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.object_dictionary import DEVICE_STATE, VALUE_RANGE, Key, Objects, Reader, one_of
from axisync_emulator.drive.options import OPTIONS, Abort, Mode
from axisync_emulator.drive.profile import Profile

_WRAP, _HALF = 1 << 32, 1 << 31
_EXTENDED = 1 << 29
_RESTRICTED = range(0x080)
BRAKE_BIT = 1
"""Of 0x60FE:1."""
_COUNTER_OVERFLOWS = frozenset({0, *range(2, 241)})


def integer32(value: int) -> int:
    """Wrapped into INTEGER32, as an encoder's counter does."""
    return (value + _HALF) % _WRAP - _HALF


def _limited(value: float) -> int:
    return max(-_HALF, min(_HALF - 1, round(value)))


def _limited16(value: int) -> int:
    return max(-32768, min(32767, value))


@dataclass(frozen=True, slots=True)
class Parts:
    """What the objects are bound to."""

    motor: Motor
    profile: Profile
    inputs: Inputs
    health: Health
    emergencies: Emergencies


def bind(objects: Objects, parts: Parts) -> None:
    """Connects the object dictionary to the drive's parts."""
    objects.readers.update(_motion(parts.motor, parts.profile))
    objects.readers.update(_condition(parts))
    _bind_errors(objects, parts.emergencies)
    _bind_writers(objects, parts.profile)
    _bind_checks(objects)


def _motion(motor: Motor, profile: Profile) -> dict[Key, Reader]:
    return {
        (0x6040, 0): lambda _now: profile.controlword,
        (0x6041, 0): profile.statusword,
        (0x6060, 0): lambda _now: profile.mode,
        (0x6061, 0): lambda _now: profile.mode,
        (0x6062, 0): lambda now: integer32(round(motor.demand_position(now))),
        (0x6064, 0): lambda now: integer32(motor.position(now)),
        (0x606B, 0): lambda now: _limited(motor.demand_velocity(now)),
        (0x606C, 0): lambda now: _limited(motor.velocity(now)),
        (0x6077, 0): lambda now: _limited16(motor.torque(now)),
        (0x6078, 0): lambda now: _limited16(motor.torque(now)),
        (0x607A, 0): lambda _now: profile.csp.target,
        (0x60F4, 0): lambda now: _limited(motor.demand_position(now) - motor.position(now)),
    }


def _condition(parts: Parts) -> dict[Key, Reader]:
    motor, inputs, health = parts.motor, parts.inputs, parts.health
    return {
        (0x1002, 0): lambda now: _manufacturer_status(parts, now),
        (0x2001, 0): lambda _now: int(inputs.torque_off),
        (0x2003, 0): lambda now: _limited16(round(10 * health.temperature.at(now))),
        (0x6079, 0): lambda now: max(0, round(1000 * health.voltage.at(now))),
        (0x60FD, 0): lambda now: inputs.word(motor.mechanical(now)),
        (0x60FE, 1): lambda now: 0 if motor.can_move(now) else BRAKE_BIT,
    }


def _manufacturer_status(parts: Parts, now: int) -> int:
    """0x1002, as the EDS describes it."""
    health = parts.health
    bits = (
        parts.inputs.torque_off, parts.motor.can_move(now), health.temperature.warns(now), health.voltage.warns(now),
    )  # fmt: skip
    return sum(1 << position for position, bit in enumerate(bits) if bit)


def _bind_errors(objects: Objects, emergencies: Emergencies) -> None:
    objects.readers[0x1001, 0] = lambda _now: emergencies.register
    objects.readers[0x603F, 0] = lambda _now: emergencies.code
    objects.readers[0x1003, 0] = lambda _now: len(emergencies.history)
    for position in range(8):
        objects.readers[0x1003, position + 1] = _history_reader(emergencies, position)

    def clear(value: int, _now: int) -> None:
        if value:
            raise SdoAbortedError(VALUE_RANGE)
        emergencies.history.clear()

    objects.writers[0x1003, 0] = clear


def _history_reader(emergencies: Emergencies, position: int) -> Callable[[int], int]:
    def read(_now: int) -> int:
        if position >= len(emergencies.history):
            raise SdoAbortedError(0x08000024)  # no data available
        return emergencies.history[position]

    return read


def _bind_writers(objects: Objects, profile: Profile) -> None:
    def controlword(value: int, _now: int) -> None:
        profile.controlword = value

    def target(value: int, _now: int) -> None:
        profile.csp.target = value

    def outputs(_value: int, _now: int) -> None:
        """The brake is the drive's own, and there is no other output."""

    # By PDO these only take the values over, and the cycle acts once all have arrived; by SDO the write itself acts.
    objects.writers[0x6040, 0] = controlword
    objects.writers[0x607A, 0] = target
    objects.writers[0x6060, 0] = profile.set_mode
    objects.writers[0x60FE, 1] = outputs
    objects.changed[0x6040] = profile.control
    objects.changed[0x607A] = profile.follow


def _bind_checks(objects: Objects) -> None:
    checks = objects.checks
    checks[0x6060] = one_of(frozenset(Mode))
    checks[0x6098] = one_of(frozenset({0, *METHODS}))
    checks[0x6007] = one_of(frozenset(Abort))
    for index, codes in OPTIONS.items():
        checks[index] = one_of(frozenset(codes))
    checks[0x1029] = one_of(range(3), 1)
    checks[0x60C2] = _interpolation_period
    for index in (0x6080, 0x6081, 0x6083, 0x6084, 0x6085, 0x609A):
        checks[index] = _positive
    checks[0x6099] = _positive

    def counter_overflow(_sub: int, value: int) -> None:
        if value not in _COUNTER_OVERFLOWS:
            raise SdoAbortedError(VALUE_RANGE)
        if objects.number(0x1006) and value != objects.number(0x1019):
            raise SdoAbortedError(DEVICE_STATE)

    def sync_identifier(_sub: int, value: int) -> None:
        # This drive consumes SYNC, it does not produce it (bit 30), and knows standard identifiers only (bit 29).
        if value & ~0x7FF or not value:
            raise SdoAbortedError(VALUE_RANGE)

    def emergency_identifier(_sub: int, value: int) -> None:
        if value & _EXTENDED or value & 0x7FF in _RESTRICTED:
            raise SdoAbortedError(VALUE_RANGE)
        before = objects.number(0x1014)
        if not (value | before) & INVALID and value != before:
            raise SdoAbortedError(DEVICE_STATE)

    checks[0x1014] = emergency_identifier
    checks[0x1019] = counter_overflow
    checks[0x1005] = sync_identifier


def _positive(_sub: int, value: int) -> None:
    if value <= 0:
        raise SdoAbortedError(VALUE_RANGE)


def _interpolation_period(sub: int, value: int) -> None:
    if (sub == 1 and value == 0) or (sub == 2 and not -6 <= value <= 0):
        raise SdoAbortedError(VALUE_RANGE)
