"""What the cell file may say about a drive beyond its place on the bus: units, homing, what is watched."""

import re
from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from axisync_schemas.base import Strict
from axisync_schemas.cell_units import Positive, PositiveDegrees

_OBJECT = re.compile(r"^0x([0-9A-Fa-f]{4})(?::(0x[0-9A-Fa-f]{1,2}|\d{1,3}))?$")
HOMING_METHODS_HERE = frozenset({35, 37})
"""Methods that take the present position as home: nothing moves, so they need no speeds (CiA 402-2, homing mode)."""


def object_key(text: str) -> tuple[int, int]:
    """Index and sub-index of an object written as `0x6064` or `0x6064:0`.

    Raises:
        ValueError: not written so, or a sub-index over 255.
    """
    match = _OBJECT.match(text)
    sub = int(match[2], 0) if match and match[2] else 0
    if match is None or sub > 0xFF:
        raise ValueError(f"{text!r} is no object: write its index and sub-index, as in 0x6064 or 0x2000:1")
    return int(match[1], 16), sub


def _checked(text: str) -> str:
    object_key(text)
    return text


ObjectText = Annotated[str, AfterValidator(_checked)]


class DriveUnits(Strict):
    """What one unit of the drive's own speed and acceleration objects is, at the encoder of `counts_per_turn`.

    speed: 0x606C, 0x6099. acceleration: 0x6084, 0x6085, 0x609A.
    """

    speed: Positive = Field(alias="speed_counts_s", default=1.0)
    acceleration: Positive = Field(alias="acceleration_counts_s2", default=1.0)


class Homing(Strict):
    """How the drive finds its home (CiA 402-2, homing mode). At home its counts are 0: `offset_deg` of the drive, not
    0x607C, says which position of the axis that is.

    Attributes:
        method: 0x6098. switch_speed, zero_speed: 0x6099, rad/s. acceleration: 0x609A, rad/s^2.
    """

    method: int = Field(ge=-128, le=127)
    switch_speed: PositiveDegrees | None = Field(alias="switch_speed_deg_s", default=None)
    zero_speed: PositiveDegrees | None = Field(alias="zero_speed_deg_s", default=None)
    acceleration: PositiveDegrees | None = Field(alias="acceleration_deg_s2", default=None)
    timeout_s: Positive = 60.0

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.method == 0:
            raise ValueError("homing.method 0 is no homing: leave `homing` out")
        speeds = (self.switch_speed, self.zero_speed, self.acceleration)
        if self.method not in HOMING_METHODS_HERE and None in speeds:
            raise ValueError(
                f"homing.method {self.method} moves the axis, so it needs switch_speed_deg_s, zero_speed_deg_s and "
                "acceleration_deg_s2"
            )
        return self


class Watched(Strict):
    """A value that is read by SDO about once a second: value = number * scale; outside low..high it is a warning."""

    object: ObjectText
    scale: Positive = 1.0
    low: float | None = None
    high: float | None = None


class WatchedBit(Strict):
    """A state that is read by SDO about once a second: set when any bit of `mask` is, or none where `inverted`."""

    object: ObjectText
    mask: int = Field(ge=1, le=0xFFFFFFFF, default=0xFFFFFFFF)
    inverted: bool = False


class Monitor(Strict):
    """What is watched. An object that the drive does not have is asked for once, and then left alone.

    Attributes:
        temperature: degrees Celsius. voltage: of the DC link, V. safe_torque_off: set while the input is active.
    """

    temperature: Watched | None = None
    voltage: Watched | None = Watched(object="0x6079", scale=0.001)
    safe_torque_off: WatchedBit | None = None
