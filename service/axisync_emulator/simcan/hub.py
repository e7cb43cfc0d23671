"""One simcan bus: the drives of this process on it directly, everyone else over a socket.

Everything happens in bus time: frames carry when they were sent, timers fire between them in the order of time. So a
pause of this process delays what others receive, and changes nothing of what happens on the bus.
"""

import socket
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from axisync_emulator.segment import FrameLog, Listeners, Station
from axisync_emulator.simcan.listening import listen_at
from axisync_emulator.simcan.medium import Medium
from axisync_emulator.simcan.protocol import FRAME, PACKET_MAX, Hello, ProtocolError, unpack_frames, widen
from axisync_emulator.timers import NEVER, Timers

TRANSMIT_QUEUE = 256
"""Frames of one client that may wait for the bus; the others wait in its socket, until that is full for the client."""
_STEP_NS = 5_000_000
"""Less than a full transmit queue takes to be sent."""
_PEER_CREDENTIALS = struct.Struct("iII")


def peer_pid(sock: socket.socket) -> int:
    """The process at the other end."""
    credentials = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER_CREDENTIALS.size)
    pid: int = _PEER_CREDENTIALS.unpack(credentials)[0]
    return pid


class Disturber(Protocol):
    """Is asked about every frame, see `axisync_emulator.faults.wire`."""

    def started(self) -> None:
        """The frame in the medium has just started: it may be abandoned, changed or corrupted."""

    def completed(self, now: int) -> bool:
        """Whether the frame, complete now, reaches anyone."""


class Client:
    """Someone on a socket: the controller, a sniffer. One that is not `on_bus` receives nothing."""

    __slots__ = ("lost", "malformed", "on_bus", "outgoing", "pid", "sock", "source")

    def __init__(self, sock: socket.socket, source: int) -> None:
        self.sock = sock
        self.source = source
        self.outgoing = b""
        self.on_bus = True
        self.lost = 0
        self.malformed = 0
        self.pid = peer_pid(sock)

    def flush(self) -> None:
        """Sends what has gathered; a reader that is too slow loses it."""
        packets, self.outgoing = self.outgoing, b""
        for first in range(0, len(packets), PACKET_MAX):
            packet = packets[first : first + PACKET_MAX]
            try:
                self.sock.send(packet)
            except OSError:  # full, or gone: its end is seen when reading
                self.lost += len(packet) // FRAME.size


class Hub:
    """A bus with a listening socket.

    Attributes:
        disturber: makes faults on the wire; None: there are none.
        origins: sources that send in the name of another one, and whose.
        stalled: frames of clients stay in their sockets.

    Args:
        clock: now, ns; frames that claim to be sent later than that count as sent now.
        time_socket: path told to clients in lock-step.

    Raises:
        BusySocket: another hub serves this path.
    """

    def __init__(self, name: str, path: Path, bitrate: float, *, clock: Callable[[], int] = time.monotonic_ns,
                 time_socket: Path | None = None, log: FrameLog | None = None) -> None:  # fmt: skip
        self.name = name
        self.path = path
        self.medium = Medium(bitrate)
        self.timers = Timers()
        self.listener = listen_at(path)
        self.clients: list[Client] = []
        self.disturber: Disturber | None = None
        self.origins: dict[int, int] = {}
        self.stalled = False
        self._lost = 0
        self._listeners = Listeners()
        self._clock = clock
        self._log = log
        self._hello = Hello(name, bitrate, str(time_socket) if time_socket else None).pack()

    def attach(self) -> Station:
        """A port for a node of this process."""
        return Station(self.medium.attach(), self.medium.queue, self._listeners, self.timers)

    def accept(self) -> None:
        """Takes whoever has connected."""
        while True:
            try:
                sock, _ = self.listener.accept()
            except BlockingIOError:
                return
            sock.setblocking(False)
            widen(sock)
            try:
                sock.send(self._hello)
            except OSError:
                sock.close()
                continue
            self.clients.append(Client(sock, self.medium.attach()))

    @property
    def descriptors(self) -> list[int]:
        """Readable when someone connects or sends."""
        return [self.listener.fileno(), *(client.sock.fileno() for client in self.clients)]

    def catch_up(self, readable: set[int], horizon: int) -> None:
        """Takes in what has been sent and lets happen everything up to `horizon` ns, however long ago that began."""
        if self.listener.fileno() in readable:
            self.accept()
        reading = self.clients
        while reading:
            newest = {client: at for client in tuple(reading) if (at := self.read(client)) is not None}
            # Past the newest frame of a client that may have more to say, it is not yet known what happens.
            known = min((horizon, *newest.values()))
            self.advance(known)
            while known < horizon and any(self._full(client) for client in newest):
                known = min(horizon, known + _STEP_NS)
                self.advance(known)
            reading = [client for client in newest if not self._full(client)]
        self.advance(horizon)

    def _full(self, client: Client) -> bool:
        return self.medium.pending(client.source) >= TRANSMIT_QUEUE

    def drain(self) -> None:
        """Queues what clients have sent."""
        for client in tuple(self.clients):
            self.read(client)

    def read(self, client: Client) -> int | None:
        """Queues what one client has sent, as far as its transmit queue goes; drops it where it has closed.

        Returns the time ns of the newest frame where the queue is full: there may be more.
        """
        medium, source = self.medium, client.source
        recv = client.sock.recv
        if self.stalled:
            return None
        while medium.pending(source) < TRANSMIT_QUEUE:
            try:
                packet = recv(PACKET_MAX)
            except BlockingIOError:
                return None
            except OSError:
                packet = b""
            if not packet:
                self._drop(client)
                return None
            now = self._clock()
            try:
                for can_id, data, at in unpack_frames(packet):
                    medium.queue(source, can_id, data, min(at or now, now))
            except ProtocolError:
                client.malformed += 1
        return medium.newest(source)

    def _drop(self, client: Client) -> None:
        # What it has sent is on its way, as from a node that is unplugged after its last frame.
        self.clients.remove(client)
        self._lost += client.lost
        client.sock.close()

    @property
    def lost(self) -> int:
        """Frames that clients were too slow to take."""
        return self._lost + sum(client.lost for client in self.clients)

    @property
    def next_event(self) -> int:
        """When something happens next, ns, if nobody sends before."""
        medium = self.medium
        on_wire = medium.completion
        return min(self.timers.next, on_wire if on_wire < NEVER else medium.next_start)

    def advance(self, horizon: int) -> None:
        """Lets happen everything up to `horizon` ns: frames complete and timers fire up to and including it, frames
        start before it. At one instant frames complete first, so that a frame in time beats its time-out."""
        medium, heap = self.medium, self.timers.heap
        while True:
            timer = heap[0][0] if heap else NEVER
            completion = medium.completion
            if completion < NEVER:
                if timer < completion:
                    if timer > horizon:
                        return
                    self._fire(timer)
                elif completion <= horizon:
                    self._complete()
                else:
                    return
                continue
            start = medium.next_start
            if timer <= start:
                if timer > horizon:
                    return
                self._fire(timer)
            elif start < horizon:
                medium.start(start)
                if self.disturber is not None:
                    self.disturber.started()
            else:
                return

    def _fire(self, now: int) -> None:
        if now > self.medium.now:
            self.medium.now = now
        self.timers.fire()

    def _complete(self) -> None:
        medium = self.medium
        medium.finish()
        (_, can_id, data), source, now = medium.frame, medium.source, medium.now
        self.timers.now = now
        if self.disturber is not None:
            if not self.disturber.completed(now):
                return
            source = self.origins.get(source, source)
        if self.clients:
            packed = FRAME.pack(now, can_id, len(data), data)
            for client in self.clients:
                if client.source != source and client.on_bus:
                    client.outgoing += packed
        if self._log:
            self._log.write(self.name, can_id, data, now)
        self._listeners.deliver(can_id, data, now, source)

    def flush(self) -> None:
        """Sends to the clients what has completed."""
        for client in self.clients:
            if client.outgoing:
                client.flush()

    def close(self) -> None:
        """Ends it; the socket's path is gone."""
        for client in tuple(self.clients):
            self._drop(client)
        self.listener.close()
        self.path.unlink(missing_ok=True)
