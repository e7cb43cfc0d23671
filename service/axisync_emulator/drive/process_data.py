"""Which object is which quantity of the drive: read live by SDO and PDO alike, and which values objects may take."""

from collections.abc import Callable

from canopen import SdoAbortedError

from axisync_emulator.drive.emergency import Emergencies
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.object_dictionary import DEVICE_STATE, VALUE_RANGE, Key, Objects, one_of
from axisync_emulator.drive.options import OPTIONS, Abort
from axisync_emulator.drive.profile import MODES, Profile

_WRAP, _HALF = 1 << 32, 1 << 31
_COUNTER_OVERFLOWS = frozenset({0, *range(2, 241)})


def integer32(value: int) -> int:
    """Wrapped into INTEGER32, as an encoder's counter does."""
    return (value + _HALF) % _WRAP - _HALF


def _limited(value: float) -> int:
    return max(-_HALF, min(_HALF - 1, round(value)))


def bind(objects: Objects, motor: Motor, profile: Profile, emergencies: Emergencies) -> None:
    """Connects the object dictionary to the drive's parts."""
    _bind_readers(objects, motor, profile)
    _bind_errors(objects, emergencies)
    _bind_writers(objects, profile)
    _bind_checks(objects)


def _bind_readers(objects: Objects, motor: Motor, profile: Profile) -> None:
    readers: dict[Key, Callable[[int], int]] = {
        (0x6040, 0): lambda _now: profile.controlword,
        (0x6041, 0): profile.statusword,
        (0x6060, 0): lambda _now: profile.mode,
        (0x6061, 0): lambda _now: profile.mode,
        (0x6062, 0): lambda now: integer32(round(motor.demand_position(now))),
        (0x6064, 0): lambda now: integer32(motor.position(now)),
        (0x606B, 0): lambda now: _limited(motor.demand_velocity(now)),
        (0x606C, 0): lambda now: _limited(motor.velocity(now)),
        (0x6077, 0): lambda now: max(-32768, min(32767, motor.torque(now))),
        (0x607A, 0): lambda _now: profile.target,
        (0x60F4, 0): lambda now: _limited(motor.demand_position(now) - motor.position(now)),
    }
    objects.readers.update(readers)


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
        profile.target = value

    # By PDO these only take the values over, and the cycle acts once all have arrived; by SDO the write itself acts.
    objects.writers[0x6040, 0] = controlword
    objects.writers[0x607A, 0] = target
    objects.writers[0x6060, 0] = profile.set_mode
    objects.changed[0x6040] = profile.control
    objects.changed[0x607A] = profile.follow


def _bind_checks(objects: Objects) -> None:
    checks = objects.checks
    checks[0x6060] = one_of(MODES)
    checks[0x6007] = one_of(frozenset(Abort))
    for index, codes in OPTIONS.items():
        checks[index] = one_of(frozenset(codes))
    checks[0x1029] = one_of(range(3), 1)
    checks[0x60C2] = _interpolation_period
    for index in (0x6084, 0x6085):
        checks[index] = _positive

    def counter_overflow(_sub: int, value: int) -> None:
        if value not in _COUNTER_OVERFLOWS:
            raise SdoAbortedError(VALUE_RANGE)
        if objects.number(0x1006) and value != objects.number(0x1019):
            raise SdoAbortedError(DEVICE_STATE)

    def sync_identifier(_sub: int, value: int) -> None:
        # This drive consumes SYNC, it does not produce it (bit 30), and knows standard identifiers only (bit 29).
        if value & ~0x7FF or not value:
            raise SdoAbortedError(VALUE_RANGE)

    checks[0x1019] = counter_overflow
    checks[0x1005] = sync_identifier


def _positive(_sub: int, value: int) -> None:
    if value <= 0:
        raise SdoAbortedError(VALUE_RANGE)


def _interpolation_period(sub: int, value: int) -> None:
    if (sub == 1 and value == 0) or (sub == 2 and not -6 <= value <= 0):
        raise SdoAbortedError(VALUE_RANGE)
