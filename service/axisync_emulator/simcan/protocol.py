"""Packets on simcan's sockets (AF_UNIX, SOCK_SEQPACKET). One socket a bus, one more for lock-step time.

Bus socket. The hub speaks first: a `Hello` in JSON. From then on both ways carry packets of one or more `FRAME`s:
  time ns    to the hub: when the sender sent it, on its monotonic clock, or 0 for "now"; from the hub: when the frame's
             last bit was on the bus. In real time both are CLOCK_MONOTONIC, in lock-step both are virtual time.
  can_id     identifier with SocketCAN's flags (EXTENDED, REMOTE, ERROR)
  length     0..8
  data       8 bytes, zero behind `length`
A sender's frames keep their order, as in a controller's transmit queue. It does not receive its own frames.
Neither side ever blocks: what does not fit the socket is lost, and counted by the one who could not send.

Time socket (lock-step only, see `axisync_emulator.simcan.timing`): `WAIT` to the hub, `AT` from it.
"""

import json
import socket
import struct
from dataclasses import asdict, dataclass

PROTOCOL_VERSION = 1

FRAME = struct.Struct("<QIB3x8s")
FRAMES_MAX = 64
"""Frames in one packet."""
PACKET_MAX = FRAME.size * FRAMES_MAX

WAIT = struct.Struct("<QB7x")
"""Wait until this time ns; 1: or until a frame arrives."""
AT = struct.Struct("<Q")
"""It is this time ns now."""

BUFFER_BYTES = 1024 * 1024
"""Wished for send buffers: some thousand packets, so that a late reader loses none. The kernel may give less."""


class ProtocolError(ValueError):
    """The peer does not speak simcan, or another version of it."""


@dataclass(frozen=True, slots=True)
class Hello:
    """What the hub tells whoever connects. `time_socket` is None in real time."""

    bus: str
    bitrate: float
    time_socket: str | None
    version: int = PROTOCOL_VERSION

    def pack(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode()

    @staticmethod
    def unpack(packet: bytes) -> "Hello":
        """
        Raises:
            ProtocolError: no hello, or of another version.
        """
        try:
            hello = Hello(**json.loads(packet))
        except (ValueError, TypeError):
            raise ProtocolError("the peer is no simcan hub") from None
        if hello.version != PROTOCOL_VERSION:
            raise ProtocolError(f"the hub speaks version {hello.version} of simcan, this is {PROTOCOL_VERSION}")
        return hello


def unpack_frames(packet: bytes) -> list[tuple[int, bytes, int]]:
    """(can_id, data, time ns) of every frame in a packet.

    Raises:
        ProtocolError: not a whole number of frames, or a length above 8.
    """
    try:
        frames = [(can_id, data[:length], time) for time, can_id, length, data in FRAME.iter_unpack(packet)]
    except struct.error:
        raise ProtocolError(f"a packet of {len(packet)} bytes") from None
    if max(packet[12 :: FRAME.size], default=0) > 8:
        raise ProtocolError("a frame of more than 8 bytes")
    return frames


def widen(sock: socket.socket) -> None:
    """Asks for a large send buffer; beyond the system's limit only root is given it."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_SNDBUFFORCE, BUFFER_BYTES)
    except OSError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)


_SO_SNDBUFFORCE = 32
