"""What can be made to go wrong, as a file or a request says it. Times: s of bus time since power-on, or SYNCs seen."""

import json
import tomllib
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from axisync_schemas.base import Name, Strict

_MISTAKES_MAX = 10
StandardId = Annotated[int, Field(ge=0, le=0x7FF)]
NodeId = Annotated[int, Field(ge=1, le=127)]
Unsigned32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
Positive = Annotated[float, Field(gt=0)]
AbortCode = Annotated[int, Field(ge=0x05000000, le=0x0FFFFFFF)]


class FaultError(ValueError):
    """A script or request that cannot be followed; one line for each mistake."""


class Timed(Strict):
    """When: at once, at a time, or right after a SYNC; until cancelled, for a time, or for so many SYNCs."""

    bus: Name
    at_s: float | None = Field(ge=0, default=None)
    at_sync: int | None = Field(ge=1, default=None)
    duration_s: Positive | None = None
    syncs: int | None = Field(ge=1, default=None)

    @model_validator(mode="after")
    def _once(self) -> Self:
        if self.at_s is not None and self.at_sync is not None:
            raise ValueError("at_s and at_sync exclude each other")
        if self.duration_s is not None and self.syncs is not None:
            raise ValueError("duration_s and syncs exclude each other")
        return self


class OnFrames(Timed):
    """Which frames: identifier under a mask (every frame where there is no id); the first `skip` of them pass, then
    each is hit with this probability, `count` of them at most."""

    id: StandardId | None = None
    mask: StandardId = 0x7FF
    skip: int = Field(ge=0, default=0)
    count: int | None = Field(ge=1, default=None)
    probability: float = Field(gt=0, le=1, default=1.0)

    def meant(self, can_id: int) -> bool:
        """The fault is about frames with this identifier."""
        return self.id is None or can_id & self.mask == self.id & self.mask


class InNode(Timed):
    """In which drive."""

    node: NodeId


# On the wire: simcan only.


class Lose(OnFrames):
    """The frame vanishes in its sender: it is never on the wire."""

    kind: Literal["lose"]


class Delay(OnFrames):
    """The frame is sent later; others may overtake it."""

    kind: Literal["delay"]
    delay_s: Positive


class Duplicate(OnFrames):
    """The frame is sent again, `copies` times, `after_s` apart or as soon as the bus is free."""

    kind: Literal["duplicate"]
    copies: int = Field(ge=1, le=100, default=1)
    after_s: float = Field(ge=0, default=0.0)


class Flip(OnFrames):
    """A bit of the data flips and nobody notices; bit 0 is the lowest of the first byte. None: any bit."""

    kind: Literal["flip"]
    bit: int | None = Field(ge=0, le=63, default=None)


class Corrupt(OnFrames):
    """Everyone sees an error: error frame, and the sender tries again; after 32 in a row it is bus-off."""

    kind: Literal["corrupt"]


class Babble(Timed):
    """A node that nobody knows sends this frame over and over."""

    kind: Literal["babble"]
    id: StandardId
    data: str = Field(pattern=r"^([0-9A-Fa-f]{2}){0,8}$", default="")
    period_s: Positive = 0.001


class BusOff(Timed):
    """The CAN controller of a drive leaves the bus; without `node`, that of everyone who is not a drive here."""

    kind: Literal["bus_off"]
    node: NodeId | None = None


class Stall(Timed):
    """Frames of everyone who is not a drive here stay in their transmit buffers, until these are full."""

    kind: Literal["stall"]


# In a drive: on every bus.


class Mute(InNode):
    """It sends nothing any more, or no frames with this identifier."""

    kind: Literal["mute"]
    id: StandardId | None = None


class Deaf(InNode):
    """It receives nothing any more, or no frames with this identifier."""

    kind: Literal["deaf"]
    id: StandardId | None = None


class PowerCycle(InNode):
    """Off; on again when the fault ends. An incremental encoder then counts from 0."""

    kind: Literal["power_cycle"]
    encoder: Literal["absolute", "incremental"] = "absolute"


class Reset(InNode):
    """It restarts by itself: torque off, then a boot-up frame."""

    kind: Literal["reset"]


class Freeze(InNode):
    """Its actual position and velocity no longer change, whatever the axis does."""

    kind: Literal["freeze"]


class Jump(InNode):
    """Its actual position is this many counts off."""

    kind: Literal["jump"]
    counts: int


class WrongIdentity(InNode):
    """0x1018 says something else."""

    kind: Literal["identity"]
    vendor_id: Unsigned32 | None = None
    product_code: Unsigned32 | None = None
    revision: Unsigned32 | None = None
    serial: Unsigned32 | None = None


class Emergency(InNode):
    """It reports this error, and reacts to it as to a fault unless it is only a warning.

    Errors that go with their cause (over-temperature, a lost heartbeat) last until this ends; others until a reset.
    """

    kind: Literal["emergency"]
    code: int = Field(ge=1, le=0xFFFF)
    warning: bool = False


class NoHeartbeat(InNode):
    """It no longer sends its heartbeat; everything else goes on."""

    kind: Literal["no_heartbeat"]


class SdoFault(InNode):
    """It refuses an object with an abort code; without a code it does not answer."""

    kind: Literal["sdo"]
    index: int = Field(ge=0, le=0xFFFF)
    sub: int = Field(ge=0, le=0xFF, default=0)
    abort: AbortCode | None = None


class Drift(InNode):
    """Its clock is fast by this many parts per million (slow where negative): heartbeat and time-outs."""

    kind: Literal["drift"]
    ppm: float = Field(gt=-500_000, lt=500_000)


class SafeTorqueOff(InNode):
    """Its safety input asks for torque off."""

    kind: Literal["sto"]


class Temperature(InNode):
    """Its temperature goes there, at once or at a rate, and back when the fault ends."""

    kind: Literal["temperature"]
    celsius: float = Field(ge=-100, le=500)
    per_s: Positive | None = None


class Voltage(InNode):
    """Its DC link voltage goes there, at once or at a rate, and back when the fault ends."""

    kind: Literal["voltage"]
    volts: float = Field(ge=0, le=1000)
    per_s: Positive | None = None


class Jam(InNode):
    """Its axis is stuck."""

    kind: Literal["jam"]


class LeaveMode(InNode):
    """It leaves its mode of operation; statusword bit 12 drops."""

    kind: Literal["leave_mode"]


class StuckInput(InNode):
    """A switch no longer changes."""

    kind: Literal["input"]
    input: Literal["negative_limit", "positive_limit", "home"]
    active: bool


class Twin(InNode):
    """Another drive with the same node id joins the bus."""

    kind: Literal["twin"]


WireFault = Lose | Delay | Duplicate | Flip | Corrupt | Babble | Stall
NodeFault = (
    Mute | Deaf | PowerCycle | Reset | Freeze | Jump | WrongIdentity | Emergency | NoHeartbeat | SdoFault | Drift
    | SafeTorqueOff | Temperature | Voltage | Jam | LeaveMode | StuckInput | Twin
)  # fmt: skip
Fault = WireFault | BusOff | NodeFault
_FAULT: TypeAdapter[Fault] = TypeAdapter(Annotated[Fault, Field(discriminator="kind")])


class Script(Strict):
    """A file of faults. With the same seed the same frames are hit."""

    seed: int = 0
    faults: list[Annotated[Fault, Field(discriminator="kind")]]


def parse_fault(value: object) -> Fault:
    """One fault, from what JSON says.

    Raises:
        FaultError: it is none.
    """
    try:
        return _FAULT.validate_json(json.dumps(value))
    except ValidationError as error:
        raise FaultError(_lines(error)) from None


def read_script(path: Path) -> Script:
    """A script in TOML, or in JSON where the file is called so.

    Raises:
        FaultError: not one, or it cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8")
        value = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise FaultError(f"{path}: {error}") from None
    try:
        return Script.model_validate_json(json.dumps(value))
    except ValidationError as error:
        raise FaultError("\n".join(f"{path}: {line}" for line in _lines(error).splitlines())) from None


def _lines(error: ValidationError) -> str:
    lines = []
    for mistake in error.errors()[:_MISTAKES_MAX]:
        where = ".".join(str(part) for part in mistake["loc"])
        lines.append(f"{where}: {mistake['msg']}" if where else mistake["msg"])
    return "\n".join(lines)
