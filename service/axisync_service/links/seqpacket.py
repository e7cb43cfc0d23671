"""A non-blocking AF_UNIX SOCK_SEQPACKET client that reconnects: a message is a packet, end of file a dead peer."""

import contextlib
import logging
import selectors
import socket
import time
from collections.abc import Callable
from pathlib import Path

from axisync_schemas.internal import MAX_PACKET

log = logging.getLogger(__name__)

RETRY_NS = 50_000_000
PACKETS_AT_ONCE = 64


class Link:
    """Connects to `path` whenever it is not connected, and hands over what arrives.

    Attributes:
        since_ns: when the present connection was made.
    """

    def __init__(
        self,
        name: str,
        path: Path,
        selector: selectors.BaseSelector,
        on_packet: Callable[[bytes], None],
        on_down: Callable[[], None],
    ) -> None:
        self.name = name
        self.since_ns = 0
        self._path = str(path)
        self._selector = selector
        self._on_packet = on_packet
        self._on_down = on_down
        self._socket: socket.socket | None = None
        self._next_try_ns = 0
        self._buffer = bytearray(MAX_PACKET)

    @property
    def connected(self) -> bool:
        """There is a connection. That its peer works is for the peer's heartbeat to show."""
        return self._socket is not None

    def on_time(self, now_ns: int) -> None:
        """Connects where due."""
        if self._socket is not None or now_ns < self._next_try_ns:
            return
        self._next_try_ns = now_ns + RETRY_NS
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        try:
            connection.connect(self._path)
        except OSError:  # Not there yet, or its backlog is full.
            connection.close()
            return
        self._socket = connection
        self.since_ns = now_ns
        self._selector.register(connection, selectors.EVENT_READ, self._readable)
        log.info("link=%s connected", self.name)

    def send(self, packet: bytes) -> bool:
        """Sends a packet without waiting; False where it could not be sent."""
        if self._socket is None:
            return False
        try:
            self._socket.send(packet)
        except BlockingIOError:
            log.warning("link=%s full bytes=%d", self.name, len(packet))
            return False
        except OSError:
            self._lost()
            return False
        return True

    def close(self) -> None:
        """Ends the connection for good."""
        self._next_try_ns = time.monotonic_ns() + 10**18
        self._drop()

    def _readable(self) -> None:
        for _ in range(PACKETS_AT_ONCE):
            if self._socket is None:
                return
            try:
                size = self._socket.recv_into(self._buffer)
            except BlockingIOError:
                return
            except OSError:
                size = 0
            if size == 0:
                self._lost()
                return
            self._on_packet(bytes(self._buffer[:size]))

    def _lost(self) -> None:
        if self._socket is None:
            return
        self._drop()
        log.warning("link=%s lost", self.name)
        self._on_down()

    def _drop(self) -> None:
        if self._socket is None:
            return
        with contextlib.suppress(KeyError):
            self._selector.unregister(self._socket)
        self._socket.close()
        self._socket = None
