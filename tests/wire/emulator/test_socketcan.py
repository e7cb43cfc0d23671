"""Drives on an interface that is not simcan: python-can's virtual one here; real vcan is tested elsewhere."""

import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from axisync_emulator.drive.node import Drive
from axisync_emulator.drive.specification import specify
from axisync_emulator.faults.injector import Injector
from axisync_emulator.faults.model import parse_fault
from axisync_emulator.segment import Handler
from axisync_emulator.socketcan import KernelBus
from axisync_schemas.cell import parse_cell

CELL_FILE = Path(__file__).parents[3] / "service/axisync_service/cells/eod.toml"
MS = 1_000_000


@pytest.fixture
def master() -> Iterator[can.BusABC]:
    bus = can.Bus(interface="virtual", channel="emulator-test")
    yield bus
    bus.shutdown()


@pytest.fixture
def kernel(master: can.BusABC) -> Iterator[KernelBus]:
    bus = KernelBus("kingkong", can.Bus(interface="virtual", channel="emulator-test"))
    yield bus
    bus.close()


def frame(can_id: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=can_id, is_extended_id=False, data=data)


def received(bus: can.BusABC) -> list[tuple[int, bytes]]:
    frames = []
    while (message := bus.recv(0)) is not None:
        frames.append((message.arbitration_id, bytes(message.data)))
    return frames


def serve(kernel: KernelBus, horizon: int | None = None) -> None:
    kernel.catch_up(set(), time.monotonic_ns() if horizon is None else horizon)


def test_a_drive_boots_answers_and_beats(kernel: KernelBus, master: can.BusABC):
    drive = Drive(specify(parse_cell(CELL_FILE.read_text()).axes[0], 0), kernel.attach())
    now = time.monotonic_ns()
    drive.power_on(now)
    master.send(frame(0x601, bytes.fromhex("4018100100000000")))
    serve(kernel, now + 50 * MS)
    assert received(master) == [(0x701, b"\x00"), (0x581, bytes.fromhex("4318100153495841"))]
    serve(kernel, now + 250 * MS)
    assert received(master) == [(0x701, b"\x7f")] * 2


def test_faults_in_a_drive_need_no_simcan(kernel: KernelBus, master: can.BusABC):
    now = time.monotonic_ns()
    injector = Injector([kernel], lambda: now)
    station = kernel.attach()
    drive = Drive(specify(parse_cell(CELL_FILE.read_text()).axes[0], 0), station)
    injector.know("kingkong", drive, station)
    for fault in (
        {"kind": "drift", "ppm": 100_000}, {"kind": "deaf", "id": 0x601, "duration_s": 0.1},
        {"kind": "mute", "at_s": 0.25, "duration_s": 0.1}, {"kind": "emergency", "code": 0x2310, "at_s": 0.4},
    ):  # fmt: skip
        injector.inject(parse_fault({"bus": "kingkong", "node": 1, **fault}))
    serve(kernel, now)
    drive.power_on(now)
    master.send(frame(0x601, bytes.fromhex("4018100100000000")))
    serve(kernel, now + 500 * MS)
    assert received(master) == [
        (0x701, b"\x00"), (0x701, b"\x7f"), (0x701, b"\x7f"), (0x701, b"\x7f"),  # at 91, 182 and 364 ms
        (0x081, bytes.fromhex("1023030000000000")), (0x701, b"\x7f"),
    ]  # fmt: skip


def test_frames_that_came_in_time_beat_a_time_out_seen_late(kernel: KernelBus, master: can.BusABC):
    """The process was away for 30 ms; frames came every 10 ms, the time-out is 20 ms."""
    port = kernel.attach()
    fired: list[int] = []
    watchdog = port.timer(fired.append)
    listener: Handler = lambda _data, now: watchdog.set(now + 20 * MS)  # noqa: E731
    port.listen(0x80, listener)
    watchdog.set(time.monotonic_ns() + 20 * MS)
    for _ in range(3):
        time.sleep(0.01)
        master.send(frame(0x80, b"\x01"))
    serve(kernel)
    assert fired == []
    serve(kernel, time.monotonic_ns() + 21 * MS)
    assert len(fired) == 1


def test_sends_when_due_and_in_order(kernel: KernelBus, master: can.BusABC):
    a, b = kernel.attach(), kernel.attach()
    heard: list[int] = []
    b.listen(0x181, lambda _data, now: heard.append(now))
    a.send(0x182, b"", 2000)
    a.send(0x181, b"", 1000)
    assert kernel.next_event == 1000
    kernel.advance(1500)
    assert received(master) == [(0x181, b"")]
    assert heard == [1000]
    kernel.advance(2500)
    assert received(master) == [(0x182, b"")]


def test_a_node_does_not_hear_itself(kernel: KernelBus):
    a = kernel.attach()
    heard: list[int] = []
    a.listen(0x181, lambda _data, now: heard.append(now))
    a.send(0x181, b"", 1000)
    kernel.advance(1500)
    assert heard == []
