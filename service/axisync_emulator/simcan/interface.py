"""python-can's interface to a simcan bus: `can.Bus(interface="simcan", channel="/run/axisync/kingkong.sock")`."""

import errno
import select
import socket
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import can

from axisync_emulator.simcan import timing
from axisync_emulator.simcan.protocol import FRAME, FRAMES_MAX, PACKET_MAX, Hello, ProtocolError, unpack_frames, widen
from axisync_emulator.simcan.wire import ERROR, EXTENDED, EXTENDED_MASK, REMOTE

_CONNECT_TIMEOUT_S = 5.0


class SimCanBus(can.BusABC):
    """A participant of a simcan bus. Sending never blocks; what does not fit is refused at once, as with ENOBUFS.

    Messages are stamped with the time at which their last bit was on the bus: CLOCK_MONOTONIC, or virtual time in
    lock-step, in seconds. Besides python-can's methods there are `send_frames` and `drain`, which build no messages.

    Args:
        channel: path of the bus's socket.

    Raises:
        can.CanInitializationError: nobody serves the path, or no simcan hub.
    """

    def __init__(self, channel: str, can_filters: Any = None, **kwargs: object) -> None:
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._received: deque[tuple[int, bytes, int]] = deque()
        self._time: timing.TimeSource | None = None
        self._can_protocol = can.CanProtocol.CAN_20
        self.channel = channel
        self.channel_info = f"simcan {channel}"
        try:
            self._hello = self._connect(channel)
        except (OSError, ProtocolError) as error:
            self._sock.close()
            raise can.CanInitializationError(f"simcan {channel}: {error}") from None
        # In lock-step a process that never asked for the time sends at whatever time it is: stamp 0.
        self._stamp = time.monotonic_ns if self._hello.time_socket is None else _no_time
        super().__init__(channel=channel, can_filters=can_filters)

    def _connect(self, channel: str) -> Hello:
        self._sock.settimeout(_CONNECT_TIMEOUT_S)
        self._sock.connect(channel)
        hello = Hello.unpack(self._sock.recv(PACKET_MAX))
        self._sock.setblocking(False)
        widen(self._sock)
        return hello

    @property
    def bitrate(self) -> float:
        """Of the bus, bit/s."""
        return self._hello.bitrate

    @property
    def time_source(self) -> timing.TimeSource | None:
        """The virtual time of a lock-step bus, None in real time. Asking makes this process take part: from then on
        time stands still unless it waits.

        Raises:
            TimeLost: the hub has gone.
        """
        path = self._hello.time_socket
        if self._time is None and path is not None:
            self._time = timing.join(path)
            self._stamp = self._time.now_ns
        return self._time

    def fileno(self) -> int:
        """Readable when frames have arrived."""
        return self._sock.fileno()

    def send_frame(self, can_id: int, data: bytes) -> None:
        """Sends a frame; see `send_frames`."""
        self.send_frames(((can_id, data),))

    def send_frames(self, frames: Sequence[tuple[int, bytes]]) -> None:
        """Sends frames one after the other: identifier, which may carry SocketCAN's flags, and data of each.

        Raises:
            can.CanOperationError: the transmit buffer is full (error_code ENOBUFS), or the hub has gone (EPIPE). Of up
                to `FRAMES_MAX` frames none has been sent then.
        """
        stamp = self._stamp()
        packed = [FRAME.pack(stamp, can_id, len(data), data) for can_id, data in frames]
        try:
            for first in range(0, len(packed), FRAMES_MAX):
                self._sock.send(b"".join(packed[first : first + FRAMES_MAX]))
        except BlockingIOError:
            raise can.CanOperationError("the transmit buffer is full", errno.ENOBUFS) from None
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error}", errno.EPIPE) from None

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """See `send_frame`; `timeout` is not used, since sending never waits."""
        can_id = msg.arbitration_id
        if msg.is_extended_id:
            can_id |= EXTENDED
        data = bytes(msg.data)
        if msg.is_remote_frame:
            can_id |= REMOTE
            data = bytes(msg.dlc)
        self.send_frame(can_id, data)

    def drain(self) -> list[tuple[int, bytes, int]]:
        """Everything that has arrived: (can_id, data, completion time ns). Does not block.

        Raises:
            can.CanOperationError: the hub has gone, and nothing is left to read.
        """
        self._read()
        frames = list(self._received)
        self._received.clear()
        return frames

    def _read(self) -> None:
        recv, received = self._sock.recv, self._received
        while True:
            try:
                packet = recv(PACKET_MAX)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            if not packet:
                if received:
                    return
                raise can.CanOperationError(f"{self.channel_info}: the hub has gone", errno.EPIPE)
            received.extend(unpack_frames(packet))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        received = self._received
        if not received:
            self._read()
        if not received and timeout != 0:
            select.select([self._sock], [], [], timeout)
            self._read()
        while received:
            message = _message(*received.popleft())
            if self._filters is None or self._matches_filters(message):
                return message, True
        return None, True

    def shutdown(self) -> None:
        """Leaves the bus, and the lock-step time."""
        if not self._is_shutdown:
            super().shutdown()
            if self._time is not None and self._hello.time_socket is not None:
                timing.leave(self._hello.time_socket)
        self._sock.close()


def _no_time() -> int:
    return 0


def _message(can_id: int, data: bytes, at: int) -> can.Message:
    remote = bool(can_id & REMOTE)
    return can.Message(
        timestamp=at / 1e9,
        arbitration_id=can_id & EXTENDED_MASK,
        is_extended_id=bool(can_id & EXTENDED),
        is_remote_frame=remote,
        is_error_frame=bool(can_id & ERROR),
        dlc=len(data),
        data=None if remote else data,
    )
