"""What the cell file says about one emulated drive, in counts."""

import math
from dataclasses import dataclass

from axisync_schemas.cell import Axis

STEP_MARGIN = 1.5
"""A drive believes targets up to this many times its axis's velocity limit away from where it expected them."""
ENABLE_WINDOW_RAD = math.radians(2.0)
"""The first target must be this close to the actual position."""
BRAKE_RATIO = 10.0
"""How much harder than the quick stop a closing brake slows the axis."""
RATED_ACCELERATION_RATIO = 4.0
"""Rated torque accelerates the axis at this many times its quick-stop deceleration."""
_UNSIGNED32_MAX = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class DriveSpecification:
    """One drive.

    Attributes:
        start: position at power-on, counts.
        speed_limit: counts/s; the plausibility check's.
        enable_window: counts.
        deceleration: default of 0x6083, 0x6084 and 0x6085, counts/s^2.
        rated_acceleration: what rated torque gives the axis; default of 0x2002:3, counts/s^2.
        brake_deceleration: counts/s^2.
        brake_release_ns: after operation enabled, until the axis can move.
        hold_on_missed: hold the last target when the next one is missing, instead of going on.
        counts_per_turn: of the motor.
        limit_switches: negative and positive one, counts.
        home_switch: active above this position, which is the axis's zero, counts.
    """

    name: str
    node_id: int
    vendor_id: int
    product_code: int
    serial: int
    start: float
    speed_limit: float
    enable_window: float
    deceleration: int
    rated_acceleration: int
    brake_deceleration: float
    brake_release_ns: int
    hold_on_missed: bool
    counts_per_turn: int
    limit_switches: tuple[float, float]
    home_switch: float


def specify(axis: Axis, bus_number: int) -> DriveSpecification:
    """The drive of an axis; `bus_number` makes serial numbers differ between buses."""
    drive = axis.drive
    scale = abs(drive.counts_per_rad)
    slowing = scale * drive.quick_stop_deceleration
    low, high = sorted(drive.counts_per_rad * (limit - drive.offset) for limit in axis.hard_limits)
    return DriveSpecification(
        name=axis.name,
        node_id=drive.node_id,
        vendor_id=drive.identity.vendor_id,
        product_code=drive.identity.product_code,
        serial=(bus_number + 1) << 16 | drive.node_id,
        start=drive.counts_per_rad * (drive.start - drive.offset),
        speed_limit=scale * axis.limits.velocity * STEP_MARGIN,
        enable_window=scale * ENABLE_WINDOW_RAD,
        deceleration=_unsigned32(slowing),
        rated_acceleration=_unsigned32(slowing * RATED_ACCELERATION_RATIO),
        brake_deceleration=slowing * BRAKE_RATIO,
        brake_release_ns=round(drive.brake_release * 1e9),
        hold_on_missed=drive.on_missed == "hold",
        counts_per_turn=drive.counts_per_turn,
        limit_switches=(low, high),
        home_switch=-drive.counts_per_rad * drive.offset,
    )


def _unsigned32(value: float) -> int:
    return min(max(1, round(value)), _UNSIGNED32_MAX)
