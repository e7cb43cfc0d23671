"""A SocketCAN port over a pair of sockets: the kernel's error frames, bus-off, and a queue that must empty first."""

import socket
import struct
from collections.abc import Iterator
from types import SimpleNamespace

import can
import pytest

from axisync_schemas.cell import Bus
from axisync_service.bus.port import BUS_OFF, SocketCanPort

FRAME = struct.Struct("=IB3x8s")
ERROR = 0x20000000


@pytest.fixture
def pair(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[SocketCanPort, socket.socket]]:
    """The port, and the kernel's end."""
    ours, kernel = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    kernel.setblocking(False)
    monkeypatch.setattr(can, "Bus", lambda **_: SimpleNamespace(socket=ours, shutdown=ours.close))
    port = SocketCanPort(Bus(name="arm", interface="socketcan", channel="can0"))
    yield port, kernel
    port.close()
    kernel.close()


def test_frames_in_and_out(pair: tuple[SocketCanPort, socket.socket]) -> None:
    port, kernel = pair
    port.send([(0x201, b"\x0f\0")])
    assert FRAME.unpack(kernel.recv(16)) == (0x201, 2, b"\x0f\0" + bytes(6))
    for can_id in (0x181, 0x80000181, 0x40000181):
        kernel.send(FRAME.pack(can_id, 1, b"\x05" + bytes(7)))
    assert port.drain() == [(0x181, b"\x05")]
    assert (port.sent, port.received, port.lost) == (1, 1, 0)


def test_nothing_is_queued_while_the_controller_is_off_the_bus(pair: tuple[SocketCanPort, socket.socket]) -> None:
    port, kernel = pair
    kernel.send(FRAME.pack(ERROR | 0x040, 8, bytes(8)))
    assert port.drain() == []
    assert port.off
    assert port.failure == BUS_OFF
    port.send([(0x201, b"old")])
    assert port.lost == 1
    with pytest.raises(BlockingIOError):
        kernel.recv(16)


def test_after_a_restart_old_frames_leave_before_new_ones(pair: tuple[SocketCanPort, socket.socket]) -> None:
    port, kernel = pair
    port.send([(0x201, b"old")])
    kernel.send(FRAME.pack(ERROR | 0x040, 8, bytes(8)))
    port.drain()
    kernel.send(FRAME.pack(ERROR | 0x100, 8, bytes(8)))
    port.drain()
    assert port.off, "the old frame is still queued"
    port.send([(0x201, b"new")])
    assert kernel.recv(16)[8:11] == b"old"
    port.drain()
    assert not port.off
    assert port.failure is None
    port.send([(0x201, b"new")])
    assert kernel.recv(16)[8:11] == b"new"


def test_other_errors_are_no_bus_off(pair: tuple[SocketCanPort, socket.socket]) -> None:
    port, kernel = pair
    kernel.send(FRAME.pack(ERROR | 0x004, 8, bytes(8)))
    assert port.drain() == []
    assert not port.off


def test_a_full_queue_loses_the_frame_and_says_so(pair: tuple[SocketCanPort, socket.socket]) -> None:
    port, _ = pair
    for _ in range(10_000):
        port.send([(0x201, bytes(6))])
        if port.lost:
            break
    assert port.lost == 1
    assert port.failure is not None
    assert not port.off
