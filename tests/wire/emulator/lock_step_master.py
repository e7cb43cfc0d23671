"""A small master in lock-step, a program of its own: brings two drives up and moves them. `leave`: only takes part."""

import math
import struct
import sys

from axisync_emulator.simcan.interface import SimCanBus

PERIOD = 2_000_000
SDO = struct.Struct("<BHBi")
ROWS = ((0x2F, 0x1019, 0, 240), (0x23, 0x1006, 0, 2000), (0x2F, 0x6060, 0, 8), (0x23, 0x1016, 1, 127 << 16 | 60))


class Arm:
    """One bus, of which this master uses nodes 1 and 6."""

    def __init__(self, path: str) -> None:
        self.bus = SimCanBus(path)
        self.actual: dict[int, int] = {}
        self.start: dict[int, int] = {}

    def read(self) -> None:
        for can_id, data, _ in self.bus.drain():
            if 0x180 < can_id < 0x188:
                self.actual[can_id - 0x180] = struct.unpack("<Hi", data)[1]

    def cycle(self, tick: int) -> None:
        self.bus.send_frame(0x080, bytes([tick % 240 + 1]))
        self.read()
        for node in (1, 6):
            self.bus.send_frame(0x200 + node, struct.pack("<Hi", word(tick), self.target(node, tick)))
        if tick % 10 == 0:
            self.bus.send_frame(0x77F, b"\x05")

    def target(self, node: int, tick: int) -> int:
        if tick < 60:
            self.start[node] = self.actual.get(node, 0)
        return self.start[node] + round(20_000 * (1 - math.cos(max(0, tick - 60) * 0.02)))


def word(tick: int) -> int:
    return 0x06 if tick < 10 else 0x07 if tick < 15 else 0x0F


def main(directory: str) -> None:
    arms = [Arm(f"{directory}/{name}.sock") for name in ("kingkong", "wukong")]
    time = arms[0].bus.time_source
    assert time is not None
    now = time.wait_until_ns(time.now_ns() + 5_000_000)
    for node in (1, 6):
        for command, index, sub, value in ROWS:
            for arm in arms:
                arm.bus.send_frame(0x600 + node, SDO.pack(command, index, sub, value))
            now = time.wait_until_ns(now + PERIOD)
    for arm in arms:
        arm.bus.send_frame(0x000, b"\x01\x00")
    for tick in range(200):
        now = time.wait_until_ns(now + PERIOD)
        for arm in arms:
            arm.cycle(tick)
    for arm in arms:
        arm.read()
        moved = [arm.actual[node] - arm.start[node] for node in (1, 6)]
        assert all(abs(counts) > 10_000 for counts in moved), moved
        arm.bus.shutdown()


def leave(directory: str) -> None:
    bus = SimCanBus(f"{directory}/kingkong.sock")
    assert bus.time_source is not None
    sys.stdin.readline()
    bus.shutdown()


if __name__ == "__main__":
    (leave if sys.argv[2:] else main)(sys.argv[1])
