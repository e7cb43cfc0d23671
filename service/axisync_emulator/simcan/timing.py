"""Lock-step time: a process of the simulation asks the hub for its time instead of a clock.

The hub owns the time of all its buses. A process takes part by connecting to the time socket; from then on time stands
still unless it waits:

  hub     -> process   AT now          after connecting, and as the answer to every WAIT
  process -> hub       WAIT until, w   it wants nothing before `until` (ns); with w = 1 a frame for it ends the wait too

Once every participant waits, the hub takes in all frames that they sent before waiting, lets the buses run to the
earliest `until` (or to the first frame for someone who wanted it), and answers those whose wait has ended. Frames of
the buses are in the sockets before the AT. What is sent during one instant is ordered by arbitration and then by the
order in which the senders connected, so a run depends on nothing else. Who disconnects no longer counts.
"""

import socket
import threading

from axisync_emulator.simcan.protocol import AT, WAIT


class TimeLost(ConnectionError):
    """The hub that gave the time has gone."""


class TimeSource:
    """This process's participation. `now_ns` is free; `wait_until_ns` blocks until the hub says so.

    Raises:
        TimeLost: nobody serves the socket.
    """

    def __init__(self, path: str) -> None:
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._sock.connect(path)
        except OSError as error:
            self._sock.close()
            raise TimeLost(f"{path}: {error}") from None
        self._now = 0
        self._receive()

    def now_ns(self) -> int:
        """The instant at which this process acts; it moves only in `wait_until_ns`."""
        return self._now

    def wait_until_ns(self, until: int, wake_on_frame: bool = False) -> int:
        """Waits for virtual time `until` (ns) or, if wished, for a frame; returns the time it is then.

        Raises:
            TimeLost: the hub ended.
        """
        try:
            self._sock.send(WAIT.pack(until, wake_on_frame))
        except OSError as error:
            raise TimeLost(str(error)) from None
        return self._receive()

    def close(self) -> None:
        """No longer takes part."""
        self._sock.close()

    def _receive(self) -> int:
        try:
            packet = self._sock.recv(AT.size)
        except OSError:
            packet = b""
        if len(packet) != AT.size:
            raise TimeLost("the simcan hub has gone")
        (self._now,) = AT.unpack(packet)
        return self._now


_sources: dict[str, tuple[TimeSource, int]] = {}
_lock = threading.Lock()


def join(path: str) -> TimeSource:
    """This process's one participation at this time socket, shared by all its buses.

    Raises:
        TimeLost: nobody serves the socket.
    """
    with _lock:
        source, users = _sources[path] if path in _sources else (TimeSource(path), 0)
        _sources[path] = source, users + 1
        return source


def leave(path: str) -> None:
    """Undoes one `join`; the last one ends the participation."""
    with _lock:
        source, users = _sources.pop(path)
        if users > 1:
            _sources[path] = source, users - 1
        else:
            source.close()
