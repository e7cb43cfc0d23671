"""SDO server: canopen's, fed with frames and answering into the bus."""

import struct

import canopen

from axisync_emulator.drive.object_dictionary import Key, Objects
from axisync_emulator.segment import Port

RESPONSE_NS = 200_000
"""From a request to its answer."""
_ABORT = struct.Struct("<BHBI")
_INVALID_COMMAND = 0x05040001
_ADDRESSED = frozenset({0x20, 0x40, 0xA0, 0xC0})
"""Client command specifiers that name an object: download, upload, and their blocks."""
_SEGMENTS = frozenset({0x00, 0x60})
_ABORTED = 0x80
_EXPEDITED, _LAST = 0x02, 0x01


class _Network(canopen.Network):
    """What canopen's server needs of a network: the way out."""

    def __init__(self, server: "SdoService") -> None:
        super().__init__()
        self._server = server

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._server.answer(bytes(data))

    def send_periodic(self, *_args: object, **_kwargs: object) -> canopen.network.PeriodicMessageTask:
        raise NotImplementedError("heartbeats are the drive's own")


class SdoService:
    """Serves one drive's object dictionary.

    Attributes:
        faults: objects (index, sub) that an injected fault makes it refuse with this abort code, or not answer (None).
    """

    def __init__(self, objects: Objects, port: Port) -> None:
        self._objects = objects
        self._port = port
        self._answer_id = 0x580 + objects.node_id
        self._open = False
        self._request = 0
        self.faults: dict[Key, int | None] = {}
        objects.sdo.network = _Network(self)

    @property
    def request_id(self) -> int:
        """COB-ID of requests."""
        return 0x600 + self._objects.node_id

    def restart(self) -> None:
        """No transfer is open."""
        self._open = False

    def receive(self, data: bytes, now: int) -> None:
        """Serves a request (CiA 301, 7.2.4); frames that are not 8 bytes long are none."""
        if len(data) != 8:
            return
        self._objects.now = now
        self._request = data[0]
        specifier = data[0] & 0xE0
        if specifier in _SEGMENTS and not self._open:
            self.answer(_ABORT.pack(_ABORTED, 0, 0, _INVALID_COMMAND))
        elif specifier == _ABORTED:
            self._open = False
        elif specifier not in _ADDRESSED or not self._disturbed(data):
            self._objects.sdo.on_request(self.request_id, bytearray(data), now * 1e-9)  # type: ignore[no-untyped-call]

    def _disturbed(self, data: bytes) -> bool:
        """Answers by an injected fault, or not at all, where there is one for the object."""
        _, index, sub, _ = _ABORT.unpack(data)
        if (index, sub) not in self.faults:
            return False
        code = self.faults[index, sub]
        if code is not None:
            self.answer(_ABORT.pack(_ABORTED, index, sub, code))
        return True

    def answer(self, data: bytes) -> None:
        """Called by the server."""
        self._open = self._goes_on(data[0])
        self._port.send(self._answer_id, data, self._objects.now + RESPONSE_NS)

    def _goes_on(self, answer: int) -> bool:
        """Whether segments may follow (CiA 301, 7.2.4.3)."""
        kind = answer & 0xE0
        if kind == 0x40:  # upload initiated
            return not answer & _EXPEDITED
        if kind == 0x60:  # download initiated
            return not self._request & _EXPEDITED
        if kind == 0x00:  # segment uploaded
            return not answer & _LAST
        if kind == 0x20:  # segment downloaded
            return not self._request & _LAST
        return False
