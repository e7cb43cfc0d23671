"""Faults at run time: a SEQPACKET socket that takes one request in JSON a packet and answers each.

{"inject": {"kind": "lose", ...}} -> {"fault": 3};  {"cancel": 3} -> {"fault": 3};  {"list": true} -> {"faults": [...]};
what cannot be -> {"error": "..."}. In lock-step time stands still until the requester waits: it knows when it begins.
"""

import json
import socket
from pathlib import Path

from axisync_emulator.faults.injector import Injector
from axisync_emulator.faults.model import FaultError, parse_fault
from axisync_emulator.simcan.listening import listen_at
from axisync_emulator.timers import NEVER

PACKET_MAX = 65_536


class Control:
    """Serves the injector; to the loops it is a bus on which nothing happens by itself.

    Raises:
        BusySocket: another process serves this path.
    """

    def __init__(self, path: Path, injector: Injector) -> None:
        self._path = path
        self._injector = injector
        self._listener = listen_at(path)
        self._peers: list[socket.socket] = []

    @property
    def descriptors(self) -> list[int]:
        """Readable when someone connects or asks."""
        return [self._listener.fileno(), *(peer.fileno() for peer in self._peers)]

    @property
    def next_event(self) -> int:
        """Never."""
        return NEVER

    def catch_up(self, readable: set[int], _horizon: int = 0) -> None:
        """Takes who has connected, and answers."""
        if self._listener.fileno() in readable:
            self._accept()
        for peer in tuple(self._peers):
            if peer.fileno() in readable:
                self._serve(peer)

    def _accept(self) -> None:
        try:
            peer, _ = self._listener.accept()
        except BlockingIOError:
            return
        peer.setblocking(False)
        self._peers.append(peer)

    def _serve(self, peer: socket.socket) -> None:
        try:
            packet = peer.recv(PACKET_MAX)
            if packet:
                peer.send(json.dumps(self._answer(packet)).encode())
                return
        except BlockingIOError:
            return
        except OSError:  # it has gone, or does not read its answers
            pass
        self._peers.remove(peer)
        peer.close()

    def _answer(self, packet: bytes) -> dict[str, object]:
        try:
            request = json.loads(packet)
        except ValueError as error:
            return {"error": f"not JSON: {error}"}
        try:
            match request:
                case {"inject": fault}:
                    return {"fault": self._injector.inject(parse_fault(fault))}
                case {"cancel": int(number)}:
                    self._injector.cancel(number)
                    return {"fault": number}
                case {"list": True}:
                    return {"faults": [injected.as_dict() for injected in self._injector.injected]}
        except FaultError as error:
            return {"error": str(error)}
        return {"error": 'ask for {"inject": {...}}, {"cancel": number} or {"list": true}'}

    def flush(self) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Ends it; the socket's path is gone."""
        for peer in self._peers:
            peer.close()
        self._listener.close()
        self._path.unlink(missing_ok=True)


def ask(path: Path, request: dict[str, object], timeout_s: float = 5.0) -> dict[str, object]:
    """One request to a running emulator, and its answer.

    Raises:
        OSError: nobody serves the path, or no answer came.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as sock:
        sock.settimeout(timeout_s)
        sock.connect(str(path))
        sock.send(json.dumps(request).encode())
        answer: dict[str, object] = json.loads(sock.recv(PACKET_MAX))
        return answer
