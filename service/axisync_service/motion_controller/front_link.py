"""The controller's side of its socket to front: never waits, takes a bounded number of commands a tick."""

import socket

from pydantic import ValidationError

from axisync_schemas.internal import CONTROLLER_COMMAND, MAX_PACKET, Command

COMMANDS_PER_TICK = 8


class FrontLink:
    """Accepts one front at a time on a listening SOCK_SEQPACKET socket; its end of file means that front is gone.

    Attributes:
        leases_needed: with front, every motion needs a valid lease.
        lost: messages that front did not take in time. malformed: packets that were no commands.
    """

    leases_needed = True
    finished = False

    def __init__(self, listening: socket.socket) -> None:
        listening.setblocking(False)
        self._listening = listening
        self._peer: socket.socket | None = None
        self.lost = self.malformed = 0

    @property
    def connected(self) -> bool:
        """A front is there."""
        return self._peer is not None

    def poll(self) -> list[Command]:
        """Commands that have come, of at most `COMMANDS_PER_TICK` packets."""
        if self._peer is None:
            self._accept()
        commands: list[Command] = []
        for _ in range(COMMANDS_PER_TICK):
            if self._peer is None:
                break
            try:
                packet = self._peer.recv(MAX_PACKET)
            except BlockingIOError:
                break
            except OSError:
                packet = b""
            if not packet:
                self._drop()
                break
            try:
                commands.append(CONTROLLER_COMMAND.validate_json(packet))
            except ValidationError:
                self.malformed += 1
        return commands

    def _accept(self) -> None:
        try:
            self._peer, _ = self._listening.accept()
        except BlockingIOError:
            return
        self._peer.setblocking(False)

    def _drop(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None

    def send(self, packet: bytes) -> None:
        """Sends without waiting; what does not fit is lost and counted."""
        if self._peer is None:
            return
        try:
            self._peer.send(packet)
        except BlockingIOError:
            self.lost += 1
        except OSError:
            self._drop()

    def close(self) -> None:
        """Closes both sockets."""
        self._drop()
        self._listening.close()
