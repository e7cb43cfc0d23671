"""A SocketCAN interface as a bus for emulated drives. The wire is the kernel's; times are those of its time stamps."""

import contextlib
import time
from heapq import heappop, heappush

import can

from axisync_emulator.segment import FrameLog, Listeners, Station
from axisync_emulator.simcan.wire import EXTENDED, REMOTE
from axisync_emulator.timers import NEVER, Timers


class MissingInterface(OSError):
    """There is no such interface, or it is down."""


def open_interface(name: str, channel: str) -> can.BusABC:
    """The interface of bus `name`.

    Raises:
        MissingInterface: it cannot be opened.
    """
    try:
        return can.Bus(interface="socketcan", channel=channel, ignore_config=True)
    except (can.CanError, OSError) as error:
        raise MissingInterface(f"CAN interface {channel} of bus {name}: {error}") from None


class KernelBus:
    """One open interface, whose frames carry the time (s, wall clock) at which they were received."""

    def __init__(self, name: str, interface: can.BusABC, log: FrameLog | None = None) -> None:
        self.name = name
        self._bus = interface
        self.timers = Timers()
        self.lost = 0
        self._log = log
        self._listeners = Listeners()
        self._owners = 0
        self._outgoing: list[tuple[int, int, int, int, bytes]] = []  # at, sequence, owner, can_id, data
        self._sequence = 0
        self._received: list[tuple[int, int, bytes]] = []

    def attach(self) -> Station:
        """A port for a node of this process."""
        self._owners += 1
        return Station(self._owners, self._transmit, self._listeners, self.timers)

    def _transmit(self, owner: int, can_id: int, data: bytes, at: int) -> None:
        self._sequence += 1
        heappush(self._outgoing, (at, self._sequence, owner, can_id, data))

    @property
    def descriptors(self) -> list[int]:
        """Readable when frames have arrived."""
        return [self._bus.fileno()]

    @property
    def next_event(self) -> int:
        """When a timer fires or a frame is to be sent, ns."""
        return min(self.timers.next, self._outgoing[0][0] if self._outgoing else NEVER)

    def catch_up(self, _readable: set[int], horizon: int) -> None:
        """Takes in what others have sent, and lets happen everything up to this time, ns."""
        self.receive()
        self.advance(horizon)

    def receive(self) -> None:
        """Takes in all frames, with the monotonic time at which the kernel saw them."""
        offset = time.time_ns() - time.monotonic_ns()
        while True:
            try:
                message = self._bus.recv(0)
            except can.CanOperationError:  # the interface went down; it may come back
                return
            if message is None:
                return
            if not message.is_error_frame and not message.is_remote_frame:
                can_id = message.arbitration_id | (EXTENDED if message.is_extended_id else 0)
                self._received.append((round(message.timestamp * 1e9) - offset, can_id, bytes(message.data)))

    def advance(self, horizon: int) -> None:
        """Handles received frames, timers and sending in the order of their times, up to `horizon`."""
        for at, can_id, data in self._received:
            self._before(min(at, horizon), frame=True)
            self._deliver(can_id, data, at, 0)
        self._received.clear()
        self._before(horizon, frame=False)

    def _before(self, limit: int, frame: bool) -> None:
        """All timers and sends up to `limit`; a frame at that very instant beats its time-out."""
        while self.next_event < limit + (not frame):
            if self._outgoing and self._outgoing[0][0] <= self.timers.next:
                self._send(*heappop(self._outgoing))
            else:
                self.timers.fire()

    def _send(self, at: int, _sequence: int, owner: int, can_id: int, data: bytes) -> None:
        message = can.Message(arbitration_id=can_id & ~(EXTENDED | REMOTE), is_extended_id=bool(can_id & EXTENDED),
                              data=data)  # fmt: skip
        try:
            self._bus.send(message, timeout=0)
        except can.CanError:
            self.lost += 1
            return
        self._deliver(can_id, data, at, owner)

    def _deliver(self, can_id: int, data: bytes, at: int, owner: int) -> None:
        if self._log:
            self._log.write(self.name, can_id, data, at)
        self.timers.now = at
        self._listeners.deliver(can_id, data, at, owner)

    def flush(self) -> None:
        """Nothing waits: frames were sent when they were due."""

    def close(self) -> None:
        """Leaves the bus."""
        with contextlib.suppress(can.CanError):
            self._bus.shutdown()
