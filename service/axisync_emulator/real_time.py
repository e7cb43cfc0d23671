"""The loop in real time: take in what has been sent, let happen what was due, hand out what has completed."""

import select
import time
from collections.abc import Sequence
from typing import Protocol

from axisync_emulator.candump import Candump
from axisync_emulator.linux import StopRequest

PAUSE_NS = 400_000
"""At least this long between two looks, so that several frames are handled at once. Only the moment at which others see
a frame depends on it, by at most this much: on the bus everything keeps its own time."""
_IDLE_S = 1.0


class RealTimeBus(Protocol):
    """What the loop needs of a bus."""

    @property
    def descriptors(self) -> list[int]:
        """Readable when there is something to receive."""

    @property
    def next_event(self) -> int:
        """When something happens next, ns."""

    def catch_up(self, readable: set[int], horizon: int) -> None:
        """Takes in what others have sent, and lets happen everything up to this time, ns."""

    def flush(self) -> None:
        """Hands out what has completed."""


def run_real_time(buses: Sequence[RealTimeBus], stop: StopRequest, candump: Candump | None) -> None:
    """Serves until a stop is requested."""
    flushed = time.monotonic_ns()
    while not stop.requested:
        readable = _wait(buses, stop)
        # What is sent from here on comes with the next look; so everything before this instant is known.
        horizon = time.monotonic_ns()
        for bus in buses:
            bus.catch_up(readable, horizon)
            bus.flush()
        if candump is not None and horizon - flushed > 500_000_000:
            candump.flush()
            flushed = horizon
        time.sleep(PAUSE_NS * 1e-9)


def _wait(buses: Sequence[RealTimeBus], stop: StopRequest) -> set[int]:
    descriptors = [stop.fileno()]
    due = min(bus.next_event for bus in buses)
    for bus in buses:
        descriptors += bus.descriptors
    timeout = min(max(0.0, (due - time.monotonic_ns()) * 1e-9), _IDLE_S)
    return set(select.select(descriptors, [], [], timeout)[0])
