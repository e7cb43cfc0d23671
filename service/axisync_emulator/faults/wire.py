"""Faults on the wire of a simcan bus: single frames, error confinement, controllers that leave the bus."""

import random
from collections.abc import Callable

from axisync_emulator.faults.model import Corrupt, Delay, Duplicate, Flip, Lose, OnFrames
from axisync_emulator.simcan.hub import Hub
from axisync_emulator.simcan.protocol import FRAME
from axisync_emulator.simcan.wire import ERROR
from axisync_emulator.timers import Timer

_TRANSMIT_ERROR, _BUS_OFF_ABOVE = 8, 255
"""Error confinement (ISO 11898-1, 12.1.4): counts for a failed transmission; beyond this the controller is bus-off."""
RESTART_NS = 100_000_000
"""After which a controller that went bus-off by errors comes back."""
BUS_OFF_FRAME, RESTARTED_FRAME = ERROR | 0x040, ERROR | 0x100
"""What a client is told, as SocketCAN does."""
_HEADER_BITS = 19


class FrameRule:
    """One fault on frames: which, and what happens to them.

    Attributes:
        hits: frames it has hit.
    """

    def __init__(self, fault: OnFrames, draw: random.Random, over: Callable[[int], None]) -> None:
        self.fault = fault
        self.draw = draw
        self._over = over
        self._passed = 0
        self.hits = 0

    def hit(self, can_id: int, now: int) -> bool:
        """Whether this frame is hit; ends the fault with the last one of `count`."""
        fault = self.fault
        if not fault.meant(can_id):
            return False
        if self._passed < fault.skip:
            self._passed += 1
            return False
        if fault.probability < 1.0 and self.draw.random() >= fault.probability:
            return False
        self.hits += 1
        if self.hits == fault.count:
            self._over(now)
        return True


class Wire:
    """The disturber of one hub: applies the rules that are active, the first that hits."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._rules: tuple[FrameRule, ...] = ()
        self._shadows: dict[int, int] = {}
        self._errors: dict[int, int] = {}
        self._restarts: dict[int, Timer] = {}
        self.on_bus_off: dict[int, Callable[[int], None]] = {}
        self.on_restart: dict[int, Callable[[int], None]] = {}

    def add(self, rule: FrameRule) -> None:
        """Begins to disturb."""
        self._rules += (rule,)
        self._hub.disturber = self

    def remove(self, rule: FrameRule) -> None:
        """Ends it; the errors counted so far still count."""
        self._rules = tuple(other for other in self._rules if other is not rule)

    def started(self) -> None:
        """See `Disturber`."""
        medium = self._hub.medium
        if medium.source in self._hub.origins:
            return
        can_id = medium.frame[1]
        for rule in self._rules:
            if rule.hit(can_id, medium.now):
                self._disturb(rule)
                return

    def _disturb(self, rule: FrameRule) -> None:
        medium, fault = self._hub.medium, rule.fault
        _, can_id, data = medium.frame
        match fault:
            case Lose():
                medium.abandon()
            case Delay():
                medium.abandon()
                medium.queue(self._shadow(medium.source), can_id, data, medium.now + _ns(fault.delay_s))
            case Duplicate():
                for copy in range(1, fault.copies + 1):
                    medium.queue(self._shadow(medium.source), can_id, data, medium.now + copy * _ns(fault.after_s))
            case Flip() if data:
                bit = rule.draw.randrange(8 * len(data)) if fault.bit is None else fault.bit % (8 * len(data))
                medium.replace(_flipped(data, bit))
            case Corrupt():
                medium.corrupt(rule.draw.randrange(_HEADER_BITS, _HEADER_BITS + 8 * len(data) + 15))

    def completed(self, now: int) -> bool:
        """See `Disturber`."""
        medium = self._hub.medium
        source = medium.source
        if not medium.failed:
            if source in self._errors:
                self._errors[source] -= 1
                if not self._errors[source]:
                    del self._errors[source]
            return True
        self._errors[source] = self._errors.get(source, 0) + _TRANSMIT_ERROR
        if self._errors[source] > _BUS_OFF_ABOVE:
            self.bus_off(source, now)
            self._restart(source).set(now + RESTART_NS)
        else:
            medium.retry()
        return False

    def _restart(self, source: int) -> Timer:
        if source not in self._restarts:
            self._restarts[source] = self._hub.timers.make(lambda now: self.restart(source, now))
        return self._restarts[source]

    def _shadow(self, source: int) -> int:
        """A source of its own for what is sent again or later, so that nothing waits behind it."""
        if source not in self._shadows:
            self._shadows[source] = self._hub.medium.attach()
            self._hub.origins[self._shadows[source]] = source
        return self._shadows[source]

    def bus_off(self, source: int, now: int) -> None:
        """Takes a controller off the bus, with all that it wanted to send."""
        self._errors.pop(source, None)
        self._hub.medium.disconnect(source)
        self._tell(source, BUS_OFF_FRAME, now, on_bus=False)
        if source in self.on_bus_off:
            self.on_bus_off[source](now)

    def restart(self, source: int, now: int) -> None:
        """Puts it back."""
        if source in self._restarts:
            self._restarts[source].cancel()
        self._hub.medium.connect(source)
        self._tell(source, RESTARTED_FRAME, now, on_bus=True)
        if source in self.on_restart:
            self.on_restart[source](now)

    def _tell(self, source: int, can_id: int, now: int, on_bus: bool) -> None:
        for client in self._hub.clients:
            if client.source == source:
                client.on_bus = on_bus
                client.outgoing += FRAME.pack(now, can_id, 8, bytes(8))


def _flipped(data: bytes, bit: int) -> bytes:
    flipped = bytearray(data)
    flipped[bit // 8] ^= 1 << bit % 8
    return bytes(flipped)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)
