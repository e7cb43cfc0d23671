"""What is written to every drive at bring-up, as rows. Each row is read back."""

import math
from dataclasses import dataclass

from axisync_schemas import eds
from axisync_schemas.cell import Axis, Cell
from axisync_service.canopen import pdo, sync
from axisync_service.canopen.budget import tpdo2_interval, tpdo2_start

CYCLIC_SYNCHRONOUS_POSITION = 8
HOMING_MODE = 6
CSP_SUPPORTED = 1 << 7
"""Bit of 0x6502, supported drive modes."""
_EVERY_SYNC = 1
_PDO_DISABLED = 1 << 31
_NO_REMOTE_REQUEST = 1 << 30
_ABORT_CONNECTION_QUICK_STOP = 3
_SLOW_DOWN = 1
_RAMP_THEN_DISABLED = 2
_RAMP_THEN_FAULT = 2
_NO_STATE_CHANGE = 1
_INT32_MIN, _INT32_MAX = -(2**31), 2**31 - 1
_UINT32_MAX = 2**32 - 1
MISSED_CYCLES_NAME = "Missed cycles tolerated"
OWN_VENDOR = 0x41584953
"""Of the drives that the packaged EDS describes."""
_FURTHER_PDOS = ((0x1401, 0x300), (0x1402, 0x400), (0x1403, 0x500), (0x1802, 0x380), (0x1803, 0x480))
"""PDOs that the predefined connection set may have switched on (CiA 301, 7.3.3): not ours, they would load the bus."""


@dataclass(frozen=True, slots=True)
class Row:
    """One object to write.

    Attributes:
        optional: a drive without this object is still brought up.
        verify: read back and compared.
        ignored: bits that a drive may keep as it likes.
    """

    index: int
    sub: int
    value: int
    optional: bool = False
    verify: bool = True
    ignored: int = 0

    def packed(self) -> bytes:
        """The value as the object's bytes; what our EDS does not have is a COB-ID, UNSIGNED32."""
        entry = eds.drive_dictionary().entries.get((self.index, self.sub))
        return entry.pack(self.value) if entry else self.value.to_bytes(4, "little")

    def holds(self, answer: bytes) -> bool:
        """What was read back is what was written."""
        if not self.ignored:
            return answer == self.packed()
        return int.from_bytes(answer, "little") & ~self.ignored == self.value & ~self.ignored


def rows(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    """The configuration of one drive, in order (a PDO is disabled while its mapping changes, CiA 301, 7.5.2.36)."""
    return (*_communication(cell, axis), *_pdos(cell, axis), *_motion(cell, axis), *_stops(axis))


def written_indices(cell: Cell, axis: Axis) -> frozenset[int]:
    """Objects whose values the service relies on, those of the cycle and of homing too."""
    cyclic = {0x1005, 0x1014, 0x1200, 0x6040, 0x607A, 0x6098, 0x6099, 0x609A, 0x607C}
    pdos = {base + n for base in (0x1400, 0x1600, 0x1800, 0x1A00) for n in range(4)}
    return frozenset(cyclic | pdos | {row.index for row in rows(cell, axis)})


def _communication(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    consumer = cell.controller_node_id << 16 | round(cell.controller_heartbeat_timeout * 1e3)
    period_us = round(cell.period * 1e6)
    return (
        Row(0x1006, 0, 0, optional=True),  # 0x1019 may only change while the period is 0 (CiA 301, 7.5.2.22)
        Row(0x1019, 0, sync.COUNTER_OVERFLOW, optional=True),
        Row(0x1006, 0, period_us, optional=True),
        Row(0x1007, 0, round(period_us * 0.9), optional=True),
        Row(0x1016, 1, consumer),
        Row(0x1017, 0, round(cell.drive_heartbeat * 1e3)),
        Row(0x1029, 1, _NO_STATE_CHANGE, optional=True),
        *_own(cell, axis),
    )


def _own(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    """The number of missed cycles is an object of the manufacturer's: written to drives that our EDS describes."""
    dictionary = eds.drive_dictionary()
    found = [key for key in dictionary.entries if dictionary[key].name == MISSED_CYCLES_NAME]
    if axis.drive.identity.vendor_id != OWN_VENDOR or not found:
        return ()
    return (Row(*found[0], cell.missed_ticks_max, optional=True),)


def _pdos(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    # A second line of defence: drives count missing SYNCs and RPDOs to N exactly. N skipped ticks, the wait of an RPDO
    # behind TPDOs and its jitter must not trip it.
    timeout_ms = max(1, math.ceil((cell.missed_ticks_max + 4) * cell.period * 1e3 - 1e-6))
    node = axis.drive.node_id
    return (
        *_pdo(0x1400, 0x1600, pdo.RPDO1_BASE + node, pdo.RPDO1_MAPPING, _EVERY_SYNC),
        Row(0x1400, 5, timeout_ms, optional=True),
        *_pdo(0x1800, 0x1A00, pdo.TPDO1_BASE + node, pdo.TPDO1_MAPPING, _EVERY_SYNC),
        *_tpdo2(cell, axis),
        *(
            Row(index, 1, _PDO_DISABLED | base + node, optional=True, ignored=_NO_REMOTE_REQUEST)
            for index, base in _FURTHER_PDOS
        ),
    )


def _tpdo2(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    """Velocity and torque, as often as the bus has room for; each drive of a bus in a SYNC of its own."""
    node, bus = axis.drive.node_id, next(bus for bus in cell.buses if bus.name == axis.drive.bus)
    cob_id, interval = pdo.TPDO2_BASE + node, tpdo2_interval(cell, bus)
    off = Row(0x1801, 1, cob_id | _PDO_DISABLED, optional=True, ignored=_NO_REMOTE_REQUEST)
    if interval is None:
        return (off,)
    others = [a.drive.node_id for a in cell.axes if a.drive.bus == bus.name]
    start = Row(0x1801, 6, tpdo2_start(others.index(node), len(others), interval), optional=True)
    configured = _pdo(0x1801, 0x1A01, cob_id, pdo.TPDO2_MAPPING, interval, optional=True)
    return (configured[0], start, *configured[1:])


def _pdo(
    communication: int, mapping: int, cob_id: int, objects: tuple[int, ...], kind: int, optional: bool = False
) -> tuple[Row, ...]:
    return (
        Row(communication, 1, cob_id | _PDO_DISABLED, optional, verify=False),
        Row(communication, 2, kind, optional),
        Row(mapping, 0, 0, optional),
        *(Row(mapping, position, entry, optional) for position, entry in enumerate(objects, start=1)),
        Row(mapping, 0, len(objects), optional),
        Row(communication, 1, cob_id, optional, ignored=_NO_REMOTE_REQUEST),
    )


def _motion(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    drive = axis.drive
    value, exponent = interpolation_period(cell.period)
    low, high = position_range(axis)
    torque = () if drive.torque_max is None else (Row(0x6072, 0, min(round(drive.torque_max * 1e3), 0xFFFF)),)
    return (
        Row(0x6060, 0, CYCLIC_SYNCHRONOUS_POSITION),
        Row(0x60C2, 1, value),
        Row(0x60C2, 2, exponent),
        Row(0x6065, 0, round(drive.following_error_max * abs(drive.counts_per_rad)), optional=True),
        Row(0x6066, 0, max(10, round(10 * cell.period * 1e3)), optional=True),
        Row(0x607D, 1, low, optional=True),
        Row(0x607D, 2, high, optional=True),
        *torque,
    )


def _stops(axis: Axis) -> tuple[Row, ...]:
    """How the drive stops by itself (CiA 402-2, option codes)."""
    deceleration = drive_acceleration(axis, axis.drive.quick_stop_deceleration)
    return (
        Row(0x6007, 0, _ABORT_CONNECTION_QUICK_STOP, optional=True),
        Row(0x605A, 0, _RAMP_THEN_DISABLED),
        Row(0x605B, 0, _SLOW_DOWN, optional=True),
        Row(0x605C, 0, _SLOW_DOWN, optional=True),
        Row(0x605D, 0, _SLOW_DOWN, optional=True),
        Row(0x605E, 0, _RAMP_THEN_FAULT, optional=True),
        Row(0x6084, 0, deceleration, optional=True),
        Row(0x6085, 0, deceleration),
    )


def position_range(axis: Axis) -> tuple[int, int]:
    """0x607D in counts: the hard limits; the object's whole range where they do not fit an INT32 (positions wrap)."""
    drive = axis.drive
    low, high = sorted(round((limit - drive.offset) * drive.counts_per_rad) for limit in axis.hard_limits)
    if low < _INT32_MIN or high > _INT32_MAX:
        return _INT32_MIN, _INT32_MAX
    return low, high


def drive_acceleration(axis: Axis, acceleration: float) -> int:
    """rad/s^2 in the drive's unit, as its objects hold it."""
    return _in_units(acceleration * abs(axis.drive.counts_per_rad) / axis.drive.units.acceleration)


def drive_speed(axis: Axis, speed: float) -> int:
    """rad/s in the drive's unit, as its objects hold it."""
    return _in_units(speed * abs(axis.drive.counts_per_rad) / axis.drive.units.speed)


def _in_units(value: float) -> int:
    return min(max(1, round(value)), _UINT32_MAX)


def homing_rows(axis: Axis) -> tuple[Row, ...]:
    """What `home` writes before it starts (CiA 402-2, homing mode). 0x607C is 0: at home the counts are 0."""
    homing = axis.drive.homing
    if homing is None:
        return ()
    speeds = [(0x6099, 1, homing.switch_speed), (0x6099, 2, homing.zero_speed)]
    return (
        Row(0x6098, 0, homing.method),
        Row(0x607C, 0, 0, optional=True),
        *(Row(index, sub, drive_speed(axis, speed)) for index, sub, speed in speeds if speed is not None),
        *(() if homing.acceleration is None else (Row(0x609A, 0, drive_acceleration(axis, homing.acceleration)),)),
    )


def interpolation_period(period_s: float) -> tuple[int, int]:
    """Mantissa (U8) and decimal exponent of 0x60C2 (CiA 402-2): the period is mantissa * 10^exponent seconds."""
    for exponent in range(-1, -7, -1):
        mantissa = round(period_s * 10.0**-exponent)
        if 1 <= mantissa <= 255 and math.isclose(mantissa * 10.0**exponent, period_s, rel_tol=1e-9):
            return mantissa, exponent
    raise ValueError(f"a period of {period_s * 1e3:g} ms cannot be written into 0x60C2 (1..255 times a power of ten)")
