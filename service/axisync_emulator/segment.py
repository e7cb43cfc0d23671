"""A bus as the drives see it: they send, listen by identifier and set timers, all in bus time."""

from collections.abc import Callable
from typing import Protocol

from axisync_emulator.timers import Callback, Timer, Timers

Handler = Callable[[bytes, int], None]
"""Takes a frame's data and the time ns of its last bit."""


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
    """One node's `Port` on a segment."""

    def __init__(self, owner: int, transmit: Callable[[int, int, bytes, int], None], listeners: Listeners,
                 timers: Timers) -> None:  # fmt: skip
        self._owner = owner
        self._transmit = transmit
        self._listeners = listeners
        self._timers = timers

    def send(self, can_id: int, data: bytes, at: int) -> None:
        """See `Port`."""
        self._transmit(self._owner, can_id, data, at)

    def listen(self, can_id: int, handler: Handler) -> None:
        """See `Port`."""
        self._listeners.add(can_id, self._owner, handler)

    def ignore(self, can_id: int, handler: Handler) -> None:
        """See `Port`."""
        self._listeners.remove(can_id, self._owner, handler)

    def timer(self, callback: Callback) -> Timer:
        """See `Port`."""
        return self._timers.make(callback)
