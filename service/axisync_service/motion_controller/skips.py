"""Says that ticks were skipped, once a second at most: saying it each time would make the next tick late as well."""

from axisync_schemas.events import EventKind
from axisync_service.motion_controller.clock import Tick
from axisync_service.motion_controller.voice import Voice


class SkipReport:
    """Gathers skipped ticks between two reports; the first is reported at once."""

    def __init__(self, interval_ticks: int) -> None:
        self._interval = interval_ticks
        self._count = self._most = 0
        self._last = 0
        self._next_report = 0

    def add(self, tick: Tick) -> None:
        """Counts what was skipped before this tick."""
        if tick.skipped:
            self._count += tick.skipped
            self._most = max(self._most, tick.skipped)
            self._last = tick.index

    def due(self, index: int) -> bool:
        """There is something to report, and the last report was long enough ago."""
        return self._count > 0 and index >= self._next_report

    def say(self, voice: Voice) -> None:
        """Reports, and begins to gather anew."""
        text = f"{self._count} ticks skipped up to tick {self._last}, at most {self._most} in a row"
        details = {"skipped": self._count, "most_in_a_row": self._most, "last_tick": self._last}
        voice.say(EventKind.TICKS_SKIPPED, text, None, "warning", **details)
        self._next_report = self._last + self._interval
        self._count = self._most = 0
