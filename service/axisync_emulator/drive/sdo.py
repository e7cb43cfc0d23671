"""SDO server: canopen's, fed with frames and answering into the bus."""

import struct

import canopen

from axisync_emulator.drive.object_dictionary import Objects
from axisync_emulator.segment import Port

RESPONSE_NS = 200_000
"""From a request to its answer."""
_INVALID_COMMAND = struct.Struct("<BHBI")
_SEGMENTS = (0x00, 0x60)
"""Command specifiers of segments, which mean nothing before a transfer has been initiated."""


class _Network(canopen.Network):
    """What canopen's server needs of a network: the way out."""

    def __init__(self, server: "SdoService") -> None:
        super().__init__()
        self._server = server

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._server.answer(can_id, bytes(data))

    def send_periodic(self, *_args: object, **_kwargs: object) -> canopen.network.PeriodicMessageTask:
        raise NotImplementedError("heartbeats are the drive's own")


class SdoService:
    """Serves one drive's object dictionary."""

    def __init__(self, objects: Objects, port: Port) -> None:
        self._objects = objects
        self._port = port
        self._initiated = False
        objects.sdo.network = _Network(self)

    @property
    def request_id(self) -> int:
        """COB-ID of requests."""
        return 0x600 + self._objects.node_id

    def restart(self) -> None:
        """No transfer is open."""
        self._initiated = False

    def receive(self, data: bytes, now: int) -> None:
        """Serves a request (CiA 301, 7.2.4); frames that are not 8 bytes long are none."""
        if len(data) != 8:
            return
        self._objects.now = now
        segment = data[0] & 0xE0 in _SEGMENTS
        if segment and not self._initiated:
            self.answer(0x580 + self._objects.node_id, _INVALID_COMMAND.pack(0x80, 0, 0, 0x05040001))
            return
        self._initiated = True
        self._objects.sdo.on_request(self.request_id, bytearray(data), now * 1e-9)  # type: ignore[no-untyped-call]

    def answer(self, can_id: int, data: bytes) -> None:
        """Called by the server."""
        self._port.send(can_id, data, self._objects.now + RESPONSE_NS)
