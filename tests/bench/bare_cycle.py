"""A cycle that only moves frames: what Python and the kernel take for them here, without a single decision.

Arguments: PERIOD_NS TICKS BUSES DRIVES, drives of each bus. Prints the ns of each cycle: SYNC, the drives' TPDOs in
packets as the simulated bus hands them out, and an RPDO for each drive. Its buses are pairs of sockets of its own.
"""

import gc
import socket
import sys
import time

from axisync_emulator.simcan.protocol import FRAME, PACKET_MAX, unpack_frames
from axisync_service.canopen.pdo import RPDO1_BASE, TPDO1_BASE, make_rpdo1, parse_tpdo1
from axisync_service.canopen.sync import FRAMES, SYNC_ID
from axisync_service.motion_controller.clock import MonotonicTime

PACKETS = 2
"""From each bus in a cycle."""
STATUSWORD = 0x1637


class BareBus:
    """One end is the controller's, the other is fed before each cycle."""

    def __init__(self, drives: int) -> None:
        self._ours, self._wire = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._ours.setblocking(False)
        self._nodes = range(1, drives + 1)
        frames = [FRAME.pack(1, TPDO1_BASE + node, 6, make_rpdo1(STATUSWORD, node)) for node in self._nodes]
        self._packets = [b"".join(frames[first::PACKETS]) for first in range(PACKETS)]

    def feed(self) -> None:
        """The drives answer."""
        for packet in self._packets:
            self._wire.send(packet)

    def sync(self) -> None:
        """To all."""
        self._ours.send(FRAME.pack(time.monotonic_ns(), SYNC_ID, 1, FRAMES[0]))

    def read(self) -> dict[int, int]:
        """Positions by identifier."""
        found: dict[int, int] = {}
        while True:
            try:
                packet = self._ours.recv(PACKET_MAX)
            except BlockingIOError:
                return found
            for can_id, data, _ in unpack_frames(packet):
                found[can_id] = parse_tpdo1(data)[1]

    def write(self) -> None:
        """A target for each drive."""
        now = time.monotonic_ns()
        frames = [FRAME.pack(now, RPDO1_BASE + node, 6, make_rpdo1(0x000F, node)) for node in self._nodes]
        self._ours.send(b"".join(frames))

    def swallow(self) -> None:
        """The wire takes SYNC and targets."""
        self._wire.recv(PACKET_MAX)
        self._wire.recv(PACKET_MAX)


def main(period_ns: int, ticks: int, buses: int, drives: int) -> None:
    gc.disable()
    clock, rig, spent = MonotonicTime(), [BareBus(drives) for _ in range(buses)], []
    due = clock.now_ns()
    for _ in range(ticks):
        for bus in rig:
            bus.feed()
        due += period_ns
        clock.wait_until_ns(due)
        begin = time.monotonic_ns()
        for bus in rig:
            bus.sync()
        for bus in rig:
            bus.read()
        for bus in rig:
            bus.write()
        spent.append(time.monotonic_ns() - begin)
        for bus in rig:
            bus.swallow()
    print("\n".join(map(str, spent)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
