"""Begins and ends faults: at their times, right after a SYNC, or when they have hit as often as they should."""

import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import Enum

from axisync_emulator.drive.node import Drive
from axisync_emulator.faults.effects import Effect, Node, Pair, effect_in
from axisync_emulator.faults.model import Babble, BusOff, Fault, FaultError, OnFrames, Script, Stall
from axisync_emulator.faults.wire import FrameRule, Wire
from axisync_emulator.segment import Station, every
from axisync_emulator.simcan.hub import Hub
from axisync_emulator.socketcan import KernelBus
from axisync_emulator.timers import Timer

SYNC_COB_ID = 0x080


class Stage(Enum):
    """Where a fault is in its life."""

    WAITING = "waiting"
    ACTIVE = "active"
    OVER = "over"


@dataclass(slots=True)
class Injected:
    """A fault that has been asked for."""

    number: int
    fault: Fault
    effect: Effect
    timer: Timer
    rule: FrameRule | None = None
    stage: Stage = Stage.WAITING
    ends_at_sync: int | None = None

    def as_dict(self) -> dict[str, object]:
        """For people and tests."""
        hits = {"hits": self.rule.hits} if self.rule else {}
        return {"fault": self.number, "stage": self.stage.value, **hits, **self.fault.model_dump(exclude_none=True)}


@dataclass(slots=True)
class Place:
    """One bus with its drives.

    Attributes:
        began: bus time at power-on, ns.
        syncs: SYNCs that have been on the bus.
        waiting: faults that begin or end with a SYNC.
    """

    bus: Hub | KernelBus
    began: int
    nodes: dict[int, Node] = field(default_factory=dict)
    wire: Wire | None = None
    syncs: int = 0
    waiting: list[Injected] = field(default_factory=list)

    def drive(self, node_id: int) -> Node:
        """
        Raises:
            FaultError: there is none with this node id.
        """
        if node_id not in self.nodes:
            raise FaultError(f"node {node_id} is none of {', '.join(map(str, self.nodes))} on bus {self.bus.name}")
        return self.nodes[node_id]


class Injector:
    """All faults of a world. Made before its drives are powered on, so that it sees a SYNC before they do.

    Args:
        clock: now, ns of bus time; what is asked for begins no earlier.
    """

    def __init__(self, buses: Iterable[Hub | KernelBus], clock: Callable[[], int]) -> None:
        self._clock = clock
        self._seed = 0
        self._count = 0
        self.injected: list[Injected] = []
        now = clock()
        self._places = {bus.name: Place(bus, now, wire=Wire(bus) if isinstance(bus, Hub) else None) for bus in buses}
        for place in self._places.values():
            place.bus.attach().listen(SYNC_COB_ID, self._sync_handler(place))

    def know(self, bus: str, drive: Drive, station: Station) -> None:
        """A drive on one of the buses."""
        place = self._places[bus]
        place.nodes[drive.specification.node_id] = Node(drive, station, place.bus.attach)
        if place.wire is not None:
            place.wire.on_bus_off[station.source] = lambda now: _cut(drive, station, now)
            place.wire.on_restart[station.source] = lambda now: _join(drive, station, now)

    # Asking for faults.

    def load(self, script: Script) -> None:
        """Asks for all faults of a script.

        Raises:
            FaultError: one of them cannot be.
        """
        self._seed = script.seed
        for fault in script.faults:
            self.inject(fault)

    def inject(self, fault: Fault) -> int:
        """Asks for a fault; its number.

        Raises:
            FaultError: there is no such bus or drive, or it needs simcan and the bus is the kernel's.
        """
        place = self._place(fault.bus)
        self._count += 1
        timer = place.bus.timers.make(lambda now: self._on_time(injected, place, now))
        rule = self._rule(fault, lambda now: self._end(injected, place, now))
        effect = self._effect(fault, place, rule)
        injected = Injected(self._count, fault, effect, timer, rule)
        self.injected.append(injected)
        if fault.at_sync is not None:
            place.waiting.append(injected)
        else:
            now = self._clock()
            timer.set(now if fault.at_s is None else max(now, place.began + round(fault.at_s * 1e9)))
        return injected.number

    def cancel(self, number: int) -> None:
        """Ends a fault, or keeps it from beginning.

        Raises:
            FaultError: there is no such fault.
        """
        for injected in self.injected:
            if injected.number == number:
                self._end(injected, self._place(injected.fault.bus), self._clock())
                return
        raise FaultError(f"fault {number} was never asked for")

    def _place(self, bus: str) -> Place:
        if bus not in self._places:
            raise FaultError(f"bus {bus!r} is none of {', '.join(self._places)}")
        return self._places[bus]

    def _rule(self, fault: Fault, over: Callable[[int], None]) -> FrameRule | None:
        # A generator of its own for each fault: what one of them draws does not change the others.
        draw = random.Random(f"{self._seed}/{self._count}")
        return FrameRule(fault, draw, over) if isinstance(fault, OnFrames) else None

    def _effect(self, fault: Fault, place: Place, rule: FrameRule | None) -> Effect:
        if not isinstance(fault, (OnFrames, Babble, BusOff, Stall)):
            return effect_in(place.drive(fault.node), fault)
        wire, hub = place.wire, place.bus
        if wire is None or not isinstance(hub, Hub):
            raise FaultError(f"{fault.kind} needs simcan, the wire of bus {hub.name} is the kernel's: use mute or deaf")
        if rule is not None:
            return Pair(lambda _now: wire.add(rule), lambda _now: wire.remove(rule))
        if isinstance(fault, Babble):
            return Babbler(hub, fault)
        if isinstance(fault, BusOff):
            return _bus_off(wire, hub, None if fault.node is None else place.drive(fault.node).station.source)
        return Pair(lambda _now: setattr(hub, "stalled", True), lambda _now: setattr(hub, "stalled", False))

    # Their lives.

    def _on_time(self, injected: Injected, place: Place, now: int) -> None:
        if injected.stage is Stage.WAITING:
            self._begin(injected, place, now)
        else:
            self._end(injected, place, now)

    def _begin(self, injected: Injected, place: Place, now: int) -> None:
        injected.stage = Stage.ACTIVE
        fault = injected.fault
        if fault.duration_s is not None:
            injected.timer.set(now + round(fault.duration_s * 1e9))
        if fault.syncs is not None:
            # One that began with a SYNC has seen that one already.
            injected.ends_at_sync = place.syncs + fault.syncs + (fault.at_sync is None)
            if injected not in place.waiting:
                place.waiting.append(injected)
        injected.effect.begin(now)

    def _end(self, injected: Injected, place: Place, now: int) -> None:
        if injected.stage is Stage.ACTIVE:
            injected.effect.end(now)
        injected.stage = Stage.OVER
        injected.timer.cancel()
        if injected in place.waiting:
            place.waiting.remove(injected)

    def _sync_handler(self, place: Place) -> Callable[[bytes, int], None]:
        def handle(_data: bytes, now: int) -> None:
            place.syncs += 1
            for injected in tuple(place.waiting):
                if injected.stage is Stage.WAITING and injected.fault.at_sync == place.syncs:
                    self._begin(injected, place, now)
                    if injected.ends_at_sync is None:
                        place.waiting.remove(injected)
                elif injected.ends_at_sync == place.syncs:
                    self._end(injected, place, now)

        return handle


class Babbler:
    """A node of its own that sends one frame over and over."""

    def __init__(self, hub: Hub, fault: Babble) -> None:
        self._station = hub.attach()
        self._id, self._data = fault.id, bytes.fromhex(fault.data)
        self._period_ns = max(1, round(fault.period_s * 1e9))
        self._hub = hub
        self._timer = hub.timers.make(self.begin)

    def begin(self, now: int) -> None:
        """Sends, and will again; what has not been sent yet is not sent twice."""
        if not self._hub.medium.pending(self._station.source):
            self._station.send(self._id, self._data, now)
        self._timer.set(now + self._period_ns)

    def end(self, _now: int) -> None:
        """Is quiet."""
        self._timer.cancel()
        self._hub.medium.flush(self._station.source)


def _bus_off(wire: Wire, hub: Hub, source: int | None) -> Effect:
    """Of one drive, or of all clients."""
    gone: list[int] = []

    def begin(now: int) -> None:
        gone.extend([client.source for client in hub.clients] if source is None else [source])
        for one in gone:
            wire.bus_off(one, now)

    def end(now: int) -> None:
        for one in gone:
            wire.restart(one, now)

    return Pair(begin, end)


def _cut(drive: Drive, station: Station, now: int) -> None:
    station.deafen(every)
    drive.bus_off(now)


def _join(drive: Drive, station: Station, now: int) -> None:
    station.hear(every)
    drive.bus_recovered(now)
