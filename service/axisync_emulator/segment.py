"""A bus as the drives see it: they send, listen by identifier and set timers, all in bus time."""

from collections.abc import Callable
from typing import Protocol

from axisync_emulator.timers import Callback, Timer, Timers

Handler = Callable[[bytes, int], None]
"""Takes a frame's data and the time ns of its last bit."""
Matches = Callable[[int], bool]
"""Whether an identifier is meant."""


def every(_can_id: int) -> bool:
    """Every identifier is meant."""
    return True


class FrameLog(Protocol):
    """Is told every frame of a bus, e.g. `axisync_emulator.candump.Candump`."""

    def write(self, bus: str, can_id: int, data: bytes, now: int) -> None:
        """A frame whose last bit was sent at `now` ns."""


class Port(Protocol):
    """What a drive needs of its bus, whatever the bus is made of."""

    def send(self, can_id: int, data: bytes, at: int) -> None:
        """Hands a frame over at bus time `at` ns; never blocks, and a full queue loses the frame."""

    def listen(self, can_id: int, handler: Handler) -> None:
        """Calls `handler` for every frame with this identifier from another node."""

    def ignore(self, can_id: int, handler: Handler) -> None:
        """Undoes `listen`."""

    def timer(self, callback: Callback) -> Timer:
        """A timer in this bus's time."""


class Listeners:
    """Acceptance filters: which handlers want an identifier. `owner` keeps a node from hearing itself."""

    def __init__(self) -> None:
        self._table: dict[int, tuple[tuple[int, Handler], ...]] = {}

    def add(self, can_id: int, owner: int, handler: Handler) -> None:
        """Adds one."""
        self._table[can_id] = (*self._table.get(can_id, ()), (owner, handler))

    def remove(self, can_id: int, owner: int, handler: Handler) -> None:
        """Removes one; no error where there is none."""
        rest = tuple(entry for entry in self._table.get(can_id, ()) if entry != (owner, handler))
        if rest:
            self._table[can_id] = rest
        else:
            self._table.pop(can_id, None)

    def deliver(self, can_id: int, data: bytes, now: int, source: int) -> None:
        """Calls everyone who wants the frame but its sender."""
        for owner, handler in self._table.get(can_id, ()):
            if owner != source:
                handler(data, now)


class Station:
    """One node's `Port` on a segment, and what can be wrong with it.

    Attributes:
        source: the segment's number for it.
    """

    def __init__(self, source: int, transmit: Callable[[int, int, bytes, int], None], listeners: Listeners,
                 timers: Timers) -> None:  # fmt: skip
        self.source = source
        self._transmit = transmit
        self._listeners = listeners
        self._timers = timers
        self._made: list[Timer] = []
        self._stretch = 1.0
        self._heard: list[tuple[int, Handler]] = []
        self._deaf: list[Matches] = []
        self._mute: list[Matches] = []

    def send(self, can_id: int, data: bytes, at: int) -> None:
        """See `Port`."""
        if self._mute and any(matches(can_id) for matches in self._mute):
            return
        self._transmit(self.source, can_id, data, at)

    def listen(self, can_id: int, handler: Handler) -> None:
        """See `Port`."""
        self._heard.append((can_id, handler))
        if not any(matches(can_id) for matches in self._deaf):
            self._listeners.add(can_id, self.source, handler)

    def ignore(self, can_id: int, handler: Handler) -> None:
        """See `Port`."""
        if (can_id, handler) in self._heard:
            self._heard.remove((can_id, handler))
            self._listeners.remove(can_id, self.source, handler)

    def timer(self, callback: Callback) -> Timer:
        """See `Port`."""
        timer = self._timers.make(callback)
        timer.stretch = self._stretch
        self._made.append(timer)
        return timer

    # What can be wrong with it.

    def deafen(self, matches: Matches) -> None:
        """Frames with these identifiers no longer reach it."""
        self._deaf.append(matches)
        self._hear_again()

    def hear(self, matches: Matches) -> None:
        """Undoes one `deafen`."""
        self._deaf.remove(matches)
        self._hear_again()

    def _hear_again(self) -> None:
        for can_id, handler in self._heard:
            self._listeners.remove(can_id, self.source, handler)
        for can_id, handler in self._heard:
            if not any(matches(can_id) for matches in self._deaf):
                self._listeners.add(can_id, self.source, handler)

    def mute(self, matches: Matches) -> None:
        """It no longer sends frames with these identifiers."""
        self._mute.append(matches)

    def speak(self, matches: Matches) -> None:
        """Undoes one `mute`."""
        self._mute.remove(matches)

    def drift(self, stretch: float) -> None:
        """From now on its timers last so many times as long."""
        self._stretch = stretch
        for timer in self._made:
            timer.stretch = stretch
