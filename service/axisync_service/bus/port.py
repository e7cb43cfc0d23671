"""The cycle's view of a bus: send frames, drain what has come, never wait."""

import fcntl
import struct
import termios
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import can

from axisync_schemas.cell import Bus
from axisync_service.canopen.budget import TYPICAL_STUFFING
from axisync_service.motion_controller.clock import TimeSource

Frame = tuple[int, bytes]
"""11-bit identifier and data."""

FRAME_BITS = 47 + 8 * TYPICAL_STUFFING
BYTE_BITS = 8 + 2 * TYPICAL_STUFFING
"""Of a frame with an 11-bit identifier and n bytes: 47 + 8 n, and up to 8 + 2 n stuff bits (ISO 11898-1)."""
_CAN_FRAME = struct.Struct("=IB3x8s")
_FLAGS = 0xE0000000
"""Extended, remote and error frames: none of them is ours."""
_ERROR_FRAME, _ERROR_BUS_OFF, _ERROR_RESTARTED = 0x20000000, 0x040, 0x100
"""Of linux/can/error.h: the kernel says by such frames that the controller has left the bus, and is back."""
BUS_OFF = "bus-off: its controller has left the bus after too many errors"


class BusError(Exception):
    """The bus cannot be opened; one sentence that says what to do."""


class BusPort(ABC):
    """One open bus.

    Attributes:
        bits: of all frames sent and received, with the usual stuffing.
        sent, received, lost: frames; lost ones found the transmit queue full, or the bus down.
        failure: why the last frame could not be sent; None while the bus works.
        off: bus-off, or just back from it with old frames still queued: nothing is sent.
        time_source: the bus's own time in lock-step, else None.
    """

    time_source: TimeSource | None = None

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.sent = self.received = self.lost = 0
        self.bits = 0.0
        self.failure: str | None = None
        self.off = False

    def send(self, frames: Sequence[Frame]) -> None:
        """Queues frames in their order; a full queue or a dead bus loses some (counted) and never raises.

        While the controller is off the bus nothing is queued: it would be sent later, as a command of long ago.
        """
        if self.off or not frames:
            self.lost += len(frames)
            return
        self.failure = None
        queued = self._send(frames)
        self.lost += len(frames) - len(queued)
        self.sent += len(queued)
        self._count_bits(queued)

    def _count_bits(self, frames: Sequence[Frame]) -> None:
        self.bits += FRAME_BITS * len(frames) + BYTE_BITS * sum([len(data) for _, data in frames])

    @abstractmethod
    def _send(self, frames: Sequence[Frame]) -> Sequence[Frame]:
        """Those that were queued; sets `failure` where some were not. Never raises."""

    @abstractmethod
    def drain(self) -> list[Frame]:
        """Every data frame with an 11-bit identifier that has come since the last call, oldest first."""

    @abstractmethod
    def close(self) -> None:
        """Closes the bus."""


class SocketCanPort(BusPort):
    """A kernel CAN interface. python-can opens the socket; frames go through it unwrapped, 3 us each."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus)
        self._bus = _open(bus, lambda: can.Bus(interface="socketcan", channel=bus.channel))
        self._socket = self._bus.socket
        self._socket.setblocking(False)
        self._restarted = True

    def _send(self, frames: Sequence[Frame]) -> Sequence[Frame]:
        queued = []
        for frame in frames:
            can_id, data = frame
            try:
                self._socket.send(_CAN_FRAME.pack(can_id, len(data), data))
            except OSError as error:
                self.failure = str(error)
            else:
                queued.append(frame)
        return queued

    def drain(self) -> list[Frame]:
        """As declared; a bus that went down simply has no frames."""
        frames: list[Frame] = []
        receive = self._socket.recv
        try:
            while True:
                can_id, length, data = _CAN_FRAME.unpack(receive(_CAN_FRAME.size))
                if not can_id & _FLAGS:
                    frames.append((can_id, data[:length]))
                elif can_id & _ERROR_FRAME:
                    self._on_error(can_id)
        except BlockingIOError:
            pass
        except OSError as error:
            self.failure = str(error)
        if self.off and self._restarted and self._queued() == 0:
            self.off, self.failure = False, None
        self.received += len(frames)
        self._count_bits(frames)
        return frames

    def _on_error(self, can_id: int) -> None:
        if can_id & _ERROR_BUS_OFF:
            self.off, self._restarted, self.failure = True, False, BUS_OFF
        elif can_id & _ERROR_RESTARTED:
            self._restarted = True

    def _queued(self) -> int:
        """Bytes that the kernel still has of ours. It drops its queue with the carrier; what is left goes out first."""
        answer = fcntl.ioctl(self._socket, termios.TIOCOUTQ, bytes(4))
        return int.from_bytes(answer, "little")

    def close(self) -> None:
        """Closes the socket."""
        self._bus.shutdown()


class SimCanPort(BusPort):
    """The embedded simulated bus, through its python-can plug-in."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus)
        self._bus = _open(bus, lambda: can.Bus(interface="simcan", channel=bus.channel))
        self._drain = self._bus.drain
        self.time_source = self._bus.time_source

    def _send(self, frames: Sequence[Frame]) -> Sequence[Frame]:
        try:
            self._bus.send_frames(frames)
        except (OSError, can.CanError) as error:
            self.failure = str(error)
            return ()
        return frames

    def drain(self) -> list[Frame]:
        """As declared."""
        try:
            frames = [(can_id, data) for can_id, data, _ in self._drain()]
        except (OSError, can.CanError) as error:
            self.failure = str(error)
            return []
        self.received += len(frames)
        self._count_bits(frames)
        return frames

    def close(self) -> None:
        """Leaves the bus."""
        self._bus.shutdown()


def _open(bus: Bus, opener: Callable[[], Any]) -> Any:
    try:
        return opener()
    except (OSError, can.CanError) as error:
        hint = (
            f"is the interface there and up? `deploy/vcan.sh {bus.channel}` makes a virtual one"
            if bus.interface == "socketcan"
            else "is axisync-emulator running?"
        )
        raise BusError(f"bus {bus.name}: cannot open {bus.interface} {bus.channel}: {error}; {hint}") from None


_PORTS: dict[str, Callable[[Bus], BusPort]] = {"socketcan": SocketCanPort, "simcan": SimCanPort}


def open_port(bus: Bus) -> BusPort:
    """Opens a bus by its back end.

    Raises:
        BusError: it cannot be opened.
    """
    return _PORTS[bus.interface](bus)
