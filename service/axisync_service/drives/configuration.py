"""What is written to every drive at bring-up, as rows. Each row is read back."""

import math
from dataclasses import dataclass

from axisync_schemas.cell import Axis, Cell
from axisync_service.canopen import pdo, sync

CYCLIC_SYNCHRONOUS_POSITION = 8
_SYNCHRONOUS_EVERY_SYNC = 1
_PDO_DISABLED = 0x80000000
_ABORT_CONNECTION_QUICK_STOP = 3
_RAMP_THEN_DISABLED = 2
_RAMP_THEN_FAULT = 2
_NO_STATE_CHANGE = 1


@dataclass(frozen=True, slots=True)
class Row:
    """One object to write.

    Attributes:
        optional: a drive without this object is still brought up.
        verify: read back and compared.
    """

    index: int
    sub: int
    value: int
    optional: bool = False
    verify: bool = True


def rows(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    """The configuration of one drive, in order (a PDO is disabled while its mapping changes, CiA 301, 7.5.2.36)."""
    return (*_communication(cell), *_pdos(cell, axis.drive.node_id), *_motion(cell, axis))


def _communication(cell: Cell) -> tuple[Row, ...]:
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
        Row(0x2000, 0, cell.missed_ticks_max, optional=True),
    )


def _pdos(cell: Cell, node: int) -> tuple[Row, ...]:
    # A second line of defence: drives count missing SYNCs and RPDOs to N exactly. N skipped ticks, the wait of an RPDO
    # behind TPDOs and its jitter must not trip it.
    timeout_ms = max(1, math.ceil((cell.missed_ticks_max + 4) * cell.period * 1e3))
    return (
        *_pdo(0x1400, 0x1600, pdo.RPDO1_BASE + node, pdo.RPDO1_MAPPING),
        Row(0x1400, 5, timeout_ms, optional=True),
        *_pdo(0x1800, 0x1A00, pdo.TPDO1_BASE + node, pdo.TPDO1_MAPPING),
    )


def _pdo(communication: int, mapping: int, cob_id: int, objects: tuple[int, ...]) -> tuple[Row, ...]:
    return (
        Row(communication, 1, cob_id | _PDO_DISABLED, verify=False),
        Row(communication, 2, _SYNCHRONOUS_EVERY_SYNC),
        Row(mapping, 0, 0),
        *(Row(mapping, position, entry) for position, entry in enumerate(objects, start=1)),
        Row(mapping, 0, len(objects)),
        Row(communication, 1, cob_id),
    )


def _motion(cell: Cell, axis: Axis) -> tuple[Row, ...]:
    drive = axis.drive
    scale = abs(drive.counts_per_rad)
    ends = sorted(round((limit - drive.offset) * drive.counts_per_rad) for limit in axis.hard_limits)
    deceleration = min(round(drive.quick_stop_deceleration * scale), 2**32 - 1)
    value, exponent = interpolation_period(cell.period)
    return (
        Row(0x6060, 0, CYCLIC_SYNCHRONOUS_POSITION),
        Row(0x60C2, 1, value),
        Row(0x60C2, 2, exponent),
        Row(0x6007, 0, _ABORT_CONNECTION_QUICK_STOP, optional=True),
        Row(0x605A, 0, _RAMP_THEN_DISABLED),
        Row(0x605B, 0, 1, optional=True),
        Row(0x605C, 0, 1, optional=True),
        Row(0x605E, 0, _RAMP_THEN_FAULT, optional=True),
        Row(0x6065, 0, round(drive.following_error_max * scale), optional=True),
        Row(0x6066, 0, max(10, round(10 * cell.period * 1e3)), optional=True),
        Row(0x607D, 1, max(ends[0], -(2**31)), optional=True),
        Row(0x607D, 2, min(ends[1], 2**31 - 1), optional=True),
        Row(0x6084, 0, deceleration, optional=True),
        Row(0x6085, 0, deceleration),
    )


def interpolation_period(period_s: float) -> tuple[int, int]:
    """Mantissa (U8) and decimal exponent of 0x60C2 (CiA 402-2): the period is mantissa * 10^exponent seconds."""
    for exponent in range(-1, -7, -1):
        mantissa = round(period_s * 10.0**-exponent)
        if 1 <= mantissa <= 255 and math.isclose(mantissa * 10.0**exponent, period_s, rel_tol=1e-9):
            return mantissa, exponent
    raise ValueError(f"a period of {period_s * 1e3:g} ms cannot be written into 0x60C2 (1..255 times a power of ten)")
