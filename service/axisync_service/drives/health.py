"""What a drive reports beside its process data: temperature, voltage, safe torque off; and what is wrong with it."""

from collections.abc import Callable
from dataclasses import dataclass

from axisync_schemas import eds
from axisync_schemas.cell import Axis
from axisync_schemas.cell_drive import Watched, WatchedBit, object_key
from axisync_service.canopen.sdo import NO_OBJECT, NO_SUB_INDEX, SdoError

HYSTERESIS = 0.02
"""A value must come back by this share of its bound before the warning ends."""
_SIGNED = (eds.DataType.INTEGER8, eds.DataType.INTEGER16, eds.DataType.INTEGER32)

Say = Callable[[str, bool], None]
"""Takes a sentence, and whether it is a warning."""


@dataclass(slots=True)
class Quantity:
    """One watched value.

    Attributes:
        absent: the drive does not have the object.
        out: the value is outside its bounds.
    """

    name: str
    unit: str
    watched: Watched
    value: float | None = None
    absent: bool = False
    out: bool = False

    @property
    def key(self) -> tuple[int, int]:
        """Index and sub-index."""
        return object_key(self.watched.object)

    def take(self, data: bytes, say: Say) -> None:
        """A new reading, which may begin or end a warning."""
        watched = self.watched
        self.value = int.from_bytes(data, "little", signed=_signed(watched.object)) * watched.scale
        low = -float("inf") if watched.low is None else watched.low
        high = float("inf") if watched.high is None else watched.high
        margin = HYSTERESIS * (abs(self.value) if self.out else 0.0)
        out = not low + margin <= self.value <= high - margin
        if out != self.out:
            self.out = out
            bound = low if self.value < low + margin else high
            text = f"{self.name} is {self.value:.4g} {self.unit}"
            say(f"{text}, the bound is {bound:g} {self.unit}" if out else f"{text} again", out)


@dataclass(slots=True)
class Flag:
    """One watched state."""

    watched: WatchedBit
    value: bool | None = None
    absent: bool = False

    @property
    def key(self) -> tuple[int, int]:
        """Index and sub-index."""
        return object_key(self.watched.object)

    def take(self, data: bytes, say: Say) -> None:
        """A new reading; a change is said."""
        value = bool(int.from_bytes(data, "little") & self.watched.mask) != self.watched.inverted
        if value != bool(self.value):
            say("safe torque off is active" if value else "safe torque off is released", value)
        self.value = value


class Health:
    """The watched objects of one drive, read in turn.

    Attributes:
        temperature, voltage, safe_torque_off: None where the cell file names no object.
    """

    def __init__(self, axis: Axis) -> None:
        monitor = axis.drive.monitor
        self.temperature = Quantity("temperature", "degC", monitor.temperature) if monitor.temperature else None
        self.voltage = Quantity("DC link voltage", "V", monitor.voltage) if monitor.voltage else None
        self.safe_torque_off = Flag(monitor.safe_torque_off) if monitor.safe_torque_off else None
        self.items: list[Quantity | Flag] = [
            item for item in (self.safe_torque_off, self.temperature, self.voltage) if item is not None
        ]
        self._turn = 0

    @property
    def torque_is_off(self) -> bool:
        """Safe torque off is known to be active."""
        return self.safe_torque_off is not None and self.safe_torque_off.value is True

    def next(self) -> Quantity | Flag | None:
        """The item whose turn it is, of those that the drive has."""
        for _ in self.items:
            self._turn = (self._turn + 1) % len(self.items)
            if not self.items[self._turn].absent:
                return self.items[self._turn]
        return None

    def take(self, item: Quantity | Flag, answer: bytes | SdoError, say: Say) -> None:
        """The answer to a reading; an object that is not there is not asked for again."""
        if isinstance(answer, bytes):
            item.take(answer, say)
        elif answer.abort in (NO_OBJECT, NO_SUB_INDEX):
            item.absent = True

    def forget(self) -> None:
        """The drive is lost; another one may answer next."""
        for item in self.items:
            item.value, item.absent = None, False


def _signed(text: str) -> bool:
    """By the EDS; what it does not have counts as signed."""
    entry = eds.drive_dictionary().entries.get(object_key(text))
    return entry is None or entry.data_type in _SIGNED
