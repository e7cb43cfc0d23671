"""Reads the ring on from a cursor: which ticks there are, and which will never be had, and why."""

from axisync_schemas.memory import Control, Word
from axisync_schemas.tick_ring import Missing, TickRing
from axisync_service.recorder.gaps import Gap

BATCH = 2048
"""Ticks a call, so that a long backlog does not keep the recorder from its heartbeat and its sockets."""


class RingReader:
    """Where the recorder is in the ring. `next_tick` is the tick that comes next."""

    def __init__(self, control: Control, ring: TickRing) -> None:
        self._control = control
        self._ring = ring
        self.next_tick = max(1, control[Word.RECORDER_CURSOR])

    @property
    def newest(self) -> int:
        """Newest tick in the ring, 0 before the first."""
        return self._control[Word.CONTROLLER_TICK]

    @property
    def behind(self) -> int:
        """Ticks that wait."""
        return max(0, self.newest + 1 - self.next_tick)

    def rewind(self) -> None:
        """Back to the cursor: what was read since has not reached the kernel."""
        self.next_tick = max(1, self._control[Word.RECORDER_CURSOR])

    def restarted(self) -> bool:
        """True, once, when the controller has begun to count anew; reading then goes on from its first tick."""
        newest = self.newest
        if not 0 < newest < self.next_tick - 1:
            return False
        self._control[Word.RECORDER_CURSOR] = self.next_tick = 1
        return True

    def read(self, limit: int = BATCH) -> tuple[list[tuple[int, bytes]], list[Gap]]:
        """Up to `limit` ticks on from `next_tick`, and the gaps between them."""
        newest = self.newest
        gaps = self._overrun(newest)
        records = []
        for tick in range(self.next_tick, min(newest, self.next_tick + limit - 1) + 1):
            record = self._ring.read(tick)
            if record is None:
                _extend(gaps, tick, self._ring.missing(tick) is Missing.OVERWRITTEN)
            else:
                records.append((tick, record))
            self.next_tick = tick + 1
        return records, gaps

    def _overrun(self, newest: int) -> list[Gap]:
        """Leaves out what no slot can hold any more."""
        oldest = newest - self._ring.slots + 1
        if oldest <= self.next_tick:
            return []
        lost = self._ring.missing(self.next_tick) is Missing.OVERWRITTEN
        gap = Gap(self.next_tick, oldest - 1, lost)
        self.next_tick = oldest
        return [gap]


def _extend(gaps: list[Gap], tick: int, lost: bool) -> None:
    if gaps and gaps[-1].last == tick - 1 and gaps[-1].lost == lost:
        gaps[-1].last = tick
    else:
        gaps.append(Gap(tick, tick, lost))
