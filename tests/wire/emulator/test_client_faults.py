"""Faults that a client of a hub feels: its controller leaves the bus, its buffer is full, its frames vanish."""

import errno
import itertools
from collections.abc import Iterator

import can
import pytest

from axisync_emulator.faults.injector import Injector
from axisync_emulator.faults.model import FaultError, parse_fault
from axisync_emulator.faults.wire import BUS_OFF_FRAME, RESTARTED_FRAME
from axisync_emulator.simcan.interface import SimCanBus
from axisync_emulator.simcan.protocol import BUFFER_BYTES
from axisync_emulator.socketcan import KernelBus

MS = 1_000_000


class Faulty:
    """The served hub with an injector."""

    def __init__(self, served) -> None:
        self.served = served
        self.injector = Injector([served.hub], lambda: served.now)

    def inject(self, kind: str, **fields: object) -> int:
        return self.injector.inject(parse_fault({"kind": kind, "bus": "kingkong", **fields}))


@pytest.fixture
def faulty(served) -> Faulty:
    return Faulty(served)


def test_bus_off_of_the_clients(faulty: Faulty):
    served = faulty.served
    a, b = served.connect(), served.connect()
    port = served.hub.attach()
    heard: list[bytes] = []
    port.listen(0x123, lambda data, _now: heard.append(data))
    faulty.inject("bus_off", duration_s=0.05)
    served.run(MS)
    a.send_frame(0x123, b"\x01")
    port.send(0x456, b"", served.now)
    served.run(10 * MS)
    assert heard == []
    assert [can_id for can_id, *_ in b.drain()] == [BUS_OFF_FRAME]
    served.run(40 * MS)
    a.send_frame(0x123, b"\x02")
    served.run(MS)
    assert heard == [b"\x02"]
    assert [can_id for can_id, *_ in b.drain()] == [RESTARTED_FRAME, 0x123]
    message = a.recv(0)
    assert message is not None
    assert message.is_error_frame


def flood(bus: SimCanBus, count: Iterator[int]) -> None:
    while next(count) < BUFFER_BYTES:
        bus.send_frame(0x123, b"")


def test_a_full_transmit_buffer(faulty: Faulty):
    served = faulty.served
    a, b = served.connect(), served.connect()
    faulty.inject("stall", duration_s=0.1)
    served.run(MS)
    count = itertools.count()
    with pytest.raises(can.CanOperationError) as error:
        flood(a, count)
    assert error.value.error_code == errno.ENOBUFS
    sent = next(count) - 1
    served.run(50 * MS)
    assert b.drain() == []
    heard = 0
    for _ in range(sent // 100 + 60):
        served.run(10 * MS)
        heard += len(b.drain())
    assert heard == sent


def test_its_frames_vanish_or_come_twice_but_never_back_to_itself(faulty: Faulty):
    served = faulty.served
    a, b = served.connect(), served.connect()
    faulty.inject("lose", id=0x100, mask=0x7F0)
    faulty.inject("duplicate", id=0x200)
    faulty.inject("delay", id=0x300, delay_s=0.001)
    served.run(MS)
    for can_id in (0x105, 0x200, 0x300, 0x105, 0x111):
        a.send_frame(can_id, b"")
    served.run(5 * MS)
    assert [can_id for can_id, *_ in b.drain()] == [0x200, 0x200, 0x111, 0x300]
    assert a.drain() == []
    assert [injected.as_dict().get("hits") for injected in faulty.injector.injected] == [2, 1, 1]


def test_faults_on_the_wire_need_simcan():
    bus = KernelBus("kingkong", can.Bus(interface="virtual", channel="faults-test"))
    injector = Injector([bus], lambda: 0)
    with pytest.raises(FaultError, match="lose needs simcan, the wire of bus kingkong is the kernel's"):
        injector.inject(parse_fault({"kind": "lose", "bus": "kingkong"}))
    bus.close()
