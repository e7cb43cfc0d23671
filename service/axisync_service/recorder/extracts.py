"""A short file of its own around each fault, so that nobody has to cut it out of an hour."""

import re
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.topics import LOG_EVENTS
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.entries import Message
from axisync_service.recorder.log_file import LogFile
from axisync_service.recorder.names import FAULTS
from axisync_service.recorder.recent import Recent, Tick

_SECOND = 1_000_000_000
BEFORE_NS = 10 * _SECOND
AFTER_NS = 5 * _SECOND
RECENT_NS = BEFORE_NS + AFTER_NS + 2 * _SECOND
"""What is kept: an extract is written a little after its last tick."""
SAME_NS = _SECOND
"""A fault this soon after another one is a part of it: one broken drive speaks several times."""
MOST, WINDOW_NS = 6, 60 * _SECOND
"""At most so many extracts in that time."""
_NAME_CHARACTERS = 40


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that went wrong, and when (monotonic)."""

    what: str
    at_ns: int

    @property
    def first_ns(self) -> int:
        """Where its extract begins."""
        return self.at_ns - BEFORE_NS

    @property
    def last_ns(self) -> int:
        """Where its extract ends."""
        return self.at_ns + AFTER_NS


def fault_of(message: Message) -> Fault | None:
    """The fault that a message tells of: any event of severity "error" that is not about the log itself."""
    event = message.event
    if message.topic != LOG_EVENTS or event is None or event.get("severity") != "error":
        return None
    kind = str(event.get("kind"))
    if event.get("source") == "recorder" or kind.startswith("recorder"):
        return None
    return Fault(re.sub(r"[^a-z0-9_]", "_", kind.lower())[:_NAME_CHARACTERS], message.log_time_ns)


class Faults:
    """Which faults get an extract, and when it can be written. `left_out`: those that were too many."""

    def __init__(self) -> None:
        self._waiting: deque[Fault] = deque()
        self._taken: deque[int] = deque(maxlen=MOST)
        self.left_out = 0

    def add(self, fault: Fault) -> None:
        """Takes a fault, or leaves it out."""
        if self._taken and fault.at_ns - self._taken[-1] < SAME_NS:
            return
        if len(self._taken) == MOST and fault.at_ns - self._taken[0] < WINDOW_NS:
            self.left_out += 1
            return
        self._taken.append(fault.at_ns)
        self._waiting.append(fault)

    def due(self, now_ns: int, all_of_them: bool = False) -> list[Fault]:
        """Those whose last tick has come; with `all_of_them` the others, too."""
        found = []
        while self._waiting and (all_of_them or self._waiting[0].last_ns < now_ns):
            found.append(self._waiting.popleft())
        return found


class Extracts:
    """Keeps what is recent, and writes an extract some seconds after each fault."""

    def __init__(self, directory: Path, cell: Cell, cell_text: str) -> None:
        self._directory, self._cell, self._cell_text = directory, cell, cell_text
        self.recent = Recent(RECENT_NS)
        self.faults = Faults()

    def add(self, message: Message) -> None:
        """A message of the log; it may tell of a fault."""
        self.recent.add_message(message)
        fault = fault_of(message)
        if fault is not None:
            self.faults.add(fault)

    def write(self, fault: Fault, clocks: ClockPair, plans: Iterable[Message]) -> Path:
        """The extract around a fault, with `plans` for what is being played.

        Raises:
            OSError: it could not be written whole; nothing of use is left of it.
        """
        (self._directory / FAULTS).mkdir(parents=True, exist_ok=True)
        ticks = self.recent.ticks(fault.first_ns, fault.last_ns)
        messages = self.recent.messages(fault.first_ns, fault.last_ns)
        messages += [plan for plan in plans if plan not in messages]
        here = ClockPair(fault.at_ns, clocks.wall(fault.at_ns))
        file = LogFile(self._directory, self._cell, self._cell_text, here, fault.what)
        try:
            _fill(file, ticks, sorted(messages, key=lambda message: message.log_time_ns))
            file.finish()
        except OSError:
            file.abandon()
            raise
        return file.path


def _fill(file: LogFile, ticks: Sequence[Tick], messages: Sequence[Message]) -> None:
    """Both in the order of their times."""
    waiting = deque(messages)
    for tick in ticks:
        while waiting and waiting[0].log_time_ns <= tick.start_ns:
            _add(file, waiting.popleft())
        file.add_tick(tick.record, tick.tick, tick.start_ns)
    for message in waiting:
        _add(file, message)


def _add(file: LogFile, message: Message) -> None:
    file.add_json(message.topic, message.log_time_ns, message.payload)
