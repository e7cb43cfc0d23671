"""One bus with drives of the real cell file, and a scripted master on it: everything in bus time, without a clock."""

import re
import struct
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

import pytest

from axisync_emulator.candump import Candump
from axisync_emulator.drive.node import Drive
from axisync_emulator.drive.specification import specify
from axisync_emulator.faults.injector import Injector
from axisync_emulator.faults.model import NodeFault, parse_fault
from axisync_emulator.simcan.hub import Hub
from axisync_emulator.simcan.interface import SimCanBus
from axisync_schemas.cell import Axis, parse_cell

MS = 1_000_000
PERIOD = 2 * MS
START = 1000 * MS
CELL_FILE = Path(__file__).parents[3] / "service/axisync_service/cells/eod.toml"
SDO = struct.Struct("<BHBI")
NODE_KINDS = {get_args(kind.model_fields["kind"].annotation)[0] for kind in get_args(NodeFault)}


@dataclass
class Recorder:
    """Every frame: (completion ns, can_id, data)."""

    frames: list[tuple[int, int, bytes]] = field(default_factory=list)

    def write(self, bus: str, can_id: int, data: bytes, now: int) -> None:
        self.frames.append((now, can_id, data))


class Bench:
    """Drives 1..n of the small arm; `now` moves only by `run`, `cycle` and SDO."""

    def __init__(self, hub: Hub, recorder: Recorder, drives: int, on_missed: str) -> None:
        text = CELL_FILE.read_text().replace('on_missed = "extrapolate"', f'on_missed = "{on_missed}"')
        cell = parse_cell(text)
        self.hub = hub
        self.now = START
        self.recorder = recorder
        self.injector = Injector([hub], lambda: self.now)
        self.drives = [self._drive(axis) for axis in cell.axes[:drives]]
        self.drive = self.drives[0]
        self._master = hub.attach()
        self._seen = 0
        self.counter = 0
        self.sync_at = 0
        self.master_alive = False

    def _drive(self, axis: Axis) -> Drive:
        station = self.hub.attach()
        drive = Drive(specify(axis, 0), station)
        self.injector.know(self.hub.name, drive, station)
        return drive

    def inject(self, kind: str, **fields: object) -> int:
        """A fault on this bus, in node 1 where it is one in a drive and no other is named."""
        node = {"node": 1} if kind in NODE_KINDS and "node" not in fields else {}
        return self.injector.inject(parse_fault({"kind": kind, "bus": self.hub.name, **node, **fields}))

    def power_on(self) -> None:
        for drive in self.drives:
            drive.power_on(self.now)

    def send(self, can_id: int, data: bytes) -> None:
        self._master.send(can_id, data, self.now)

    def run(self, duration: int) -> list[tuple[int, int, bytes]]:
        """Lets time pass; the frames that completed in it."""
        self.now += duration
        self.hub.advance(self.now)
        return self.take()

    def take(self) -> list[tuple[int, int, bytes]]:
        frames = self.recorder.frames[self._seen :]
        self._seen = len(self.recorder.frames)
        return frames

    def request(self, node: int, payload: bytes) -> bytes:
        """One SDO frame there and back."""
        self.send(0x600 + node, payload)
        answers = [data for _, can_id, data in self.run(PERIOD) if can_id == 0x580 + node]
        assert len(answers) == 1
        return answers[0]

    def write(self, index: int, sub: int, value: int, size: int, node: int = 1) -> int:
        """Expedited download; the abort code, or 0."""
        command = 0x23 | (4 - size) << 2
        answer = self.request(node, SDO.pack(command, index, sub, value & (1 << 8 * size) - 1))
        echo, code = SDO.unpack(answer)[1:3], SDO.unpack(answer)[3]
        assert echo == (index, sub)
        assert answer[0] in (0x60, 0x80)
        return code

    def read(self, index: int, sub: int = 0, node: int = 1, signed: bool = False) -> int:
        """Expedited upload."""
        answer = self.request(node, SDO.pack(0x40, index, sub, 0))
        assert answer[0] & 0xE3 == 0x43, answer.hex()
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little", signed=signed)

    def abort_of(self, index: int, sub: int = 0, node: int = 1) -> int:
        """The abort code of an upload."""
        answer = self.request(node, SDO.pack(0x40, index, sub, 0))
        assert answer[0] == 0x80
        return SDO.unpack(answer)[3]

    def configure(self, node: int = 1) -> None:
        """As a controller would, for a 2 ms cycle with N = 5."""
        rows = (
            (0x1006, 0, 0, 4), (0x1019, 0, 240, 1), (0x1006, 0, 2000, 4), (0x2000, 0, 5, 1), (0x1029, 1, 1, 1),
            (0x6060, 0, 8, 1), (0x60C2, 1, 2, 1), (0x60C2, 2, -3, 1), (0x6007, 0, 3, 2), (0x605A, 0, 2, 2),
        )  # fmt: skip
        for row in rows:
            assert self.write(*row, node=node) == 0

    def start(self, node: int = 0) -> None:
        self.send(0x000, bytes([1, node]))
        self.run(PERIOD)

    def cycle(self, word: int | None = None, target: int | None = None, *, sync: bool = True, skip: int = 0,
              heartbeat: bool | None = None, node: int = 1) -> list[tuple[int, int, bytes]]:  # fmt: skip
        """One period: SYNC, then the RPDO of the next setpoint (none where `word` is None)."""
        self.counter = (self.counter + skip) % 240 + 1
        if sync:
            self.send(0x080, bytes([self.counter]))
        self.run_quietly(100_000)
        if sync:
            self.sync_at = next(t for t, i, _ in reversed(self.recorder.frames) if i == 0x080)
        if word is not None:
            assert target is not None
            self.send(0x200 + node, struct.pack("<Hi", word, target))
        if self.master_alive if heartbeat is None else heartbeat:
            self.send(0x77F, b"\x05")
        self.run_quietly(PERIOD - 100_000)
        return self.take()

    def run_quietly(self, duration: int) -> None:
        self.now += duration
        self.hub.advance(self.now)

    def enable(self, node: int = 1) -> int:
        """Up to operation enabled with the target at the actual position, which it returns; brake released."""
        target = self.read(0x6064, node=node, signed=True)
        for word in (0x06, 0x06, 0x07, 0x07, 0x0F, 0x0F):
            self.cycle(word, target, node=node)
        for _ in range(35):
            self.cycle(0x0F, target, node=node)
        return target

    def state(self, node: int = 1) -> int:
        return self.read(0x6041, node=node) & 0x6F

    def emergencies(self, frames: list[tuple[int, int, bytes]], node: int = 1) -> list[tuple[int, int, int]]:
        """(time, code, register) of each EMCY."""
        return [(at, *struct.unpack("<HB", data[:3])) for at, can_id, data in frames if can_id == 0x080 + node and data]


class Served:
    """A hub without a loop of its own, at a time that the test sets."""

    def __init__(self, path: Path) -> None:
        self.now = 1_000_000_000
        self.log = Candump(path.parent / "dump.log")
        self.hub = Hub("kingkong", path, 1e6, clock=lambda: self.now, log=self.log)
        self.buses: list[SimCanBus] = []

    def connect(self) -> SimCanBus:
        """A participant: the hub answers while the client waits for its hello."""
        made: list[SimCanBus] = []
        thread = threading.Thread(target=lambda: made.append(SimCanBus(str(self.hub.path))))
        thread.start()
        while thread.is_alive():
            self.hub.accept()
            thread.join(0.005)
        self.buses += made
        return made[0]

    def run(self, duration: int) -> None:
        self.hub.drain()
        self.now += duration
        self.hub.catch_up(set(), self.now)
        self.hub.flush()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    served = Served(tmp_path / "kingkong.sock")
    yield served
    for bus in served.buses:
        bus.shutdown()
    served.hub.close()
    served.log.close()


@pytest.fixture
def make_bench(tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    hubs = []

    def make(drives: int = 1, on_missed: str = "extrapolate") -> Bench:
        recorder = Recorder()
        hub = Hub("kingkong", tmp_path / f"{len(hubs)}.sock", 1e6, log=recorder)
        hubs.append(hub)
        return Bench(hub, recorder, drives, on_missed)

    yield make
    for hub in hubs:
        hub.close()


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    """One drive, booted and configured, pre-operational."""
    bench = make_bench()
    bench.power_on()
    bench.configure()
    bench.take()
    return bench


@pytest.fixture
def enabled(bench: Bench) -> tuple[Bench, int]:
    """One drive in operation enabled, at rest, and its position."""
    bench.start()
    return bench, bench.enable()


@pytest.fixture
def cell_with(tmp_path: Path) -> Callable[..., Path]:
    """A copy of the cell file with replacements."""

    def make(**replacements: str) -> Path:
        text = CELL_FILE.read_text()
        for pattern, new in replacements.items():
            text = re.sub(pattern, new, text)
        path = tmp_path / "cell.toml"
        path.write_text(text)
        return path

    return make
