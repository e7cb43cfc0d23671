"""Temperature and DC link voltage of a drive: what is measured, when it warns, when it is a fault."""

from collections.abc import Callable
from dataclasses import dataclass

from axisync_emulator.drive.emergency import ErrorCode
from axisync_emulator.timers import Timer

TEMPERATURE_C = 30.0
VOLTAGE_V = 48.0
_LOOK_NS = 10_000_000
"""How often it looks while a quantity changes."""


@dataclass(slots=True)
class Quantity:
    """Goes linearly from one value to another.

    Attributes:
        warn, bad: ranges (low, high); outside of them there is a warning, or a fault.
    """

    value: float
    warn: tuple[float, float]
    bad: tuple[float, float]
    _slope: float = 0.0
    _goal: float = 0.0
    _since: int = 0

    def at(self, now: int) -> float:
        """Its value at `now`."""
        if not self._slope:
            return self.value
        value = self.value + self._slope * (now - self._since) * 1e-9
        return min(value, self._goal) if self._slope > 0.0 else max(value, self._goal)

    def drive(self, goal: float, per_second: float | None, now: int) -> None:
        """Sets out for `goal`, at once where no rate is given."""
        self.value = self.at(now)
        self._since, self._goal, self._slope = now, goal, 0.0
        if per_second is None:
            self.value = goal
        elif goal != self.value:
            self._slope = per_second if goal > self.value else -per_second

    def settled(self, now: int) -> bool:
        """It no longer changes."""
        return not self._slope or self.at(now) == self._goal

    def warns(self, now: int) -> bool:
        """Outside what is normal."""
        return not self.warn[0] < self.at(now) < self.warn[1]


class Health:
    """Watches the quantities while they change.

    Args:
        occur, heal: told an error that has appeared (a fault), or gone.
        warn: told whether anything is outside what is normal.
    """

    def __init__(self, timer: Callable[[Callable[[int], None]], Timer], occur: Callable[[ErrorCode, int], None],
                 heal: Callable[[int, ErrorCode], None], warn: Callable[[bool], None]) -> None:  # fmt: skip
        self.temperature = Quantity(TEMPERATURE_C, warn=(-10.0, 80.0), bad=(-40.0, 90.0))
        self.voltage = Quantity(VOLTAGE_V, warn=(40.0, 56.0), bad=(36.0, 60.0))
        self._timer = timer(self._look)
        self._occur = occur
        self._heal = heal
        self._warn = warn

    def drive(self, quantity: Quantity, goal: float, per_second: float | None, now: int) -> None:
        """Lets a quantity go somewhere."""
        quantity.drive(goal, per_second, now)
        self._look(now)

    def _look(self, now: int) -> None:
        self._warn(self.temperature.warns(now) or self.voltage.warns(now))
        temperature, voltage = self.temperature.at(now), self.voltage.at(now)
        for code, present in (
            (ErrorCode.OVER_TEMPERATURE, temperature >= self.temperature.bad[1]),
            (ErrorCode.OVER_VOLTAGE, voltage >= self.voltage.bad[1]),
            (ErrorCode.UNDER_VOLTAGE, voltage <= self.voltage.bad[0]),
        ):
            if present:
                self._occur(code, now)
            else:
                self._heal(now, code)
        if not (self.temperature.settled(now) and self.voltage.settled(now)):
            self._timer.set(now + _LOOK_NS)
