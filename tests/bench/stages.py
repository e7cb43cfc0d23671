"""Where the cycle's time goes, by stage: read from the controller's own ring in shared memory while it runs."""

import mmap
import os
from pathlib import Path

from percentiles import Distribution

from axisync_schemas.memory import Control, TimingRing, Word

STAGES = ("read", "decide", "write", "record")
_FIRST_STAGE, _SKIPPED = 2, 6
"""Places in a row of `TimingRing.read`: tick, lateness, the stages, skipped."""


def map_region(pid: int, name: str) -> mmap.mmap:
    """A read-only view of the memfd `axisync-NAME` that process `pid` holds.

    Raises:
        LookupError: it holds none.
    """
    for link in Path(f"/proc/{pid}/fd").iterdir():
        if _target(link).startswith(f"/memfd:axisync-{name}"):
            descriptor = os.open(link, os.O_RDONLY)
            try:
                return mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ)
            finally:
                os.close(descriptor)
    raise LookupError(f"process {pid} holds no memory called axisync-{name}")


def _target(link: Path) -> str:
    try:
        return os.readlink(link)
    except OSError:  # closed meanwhile
        return ""


class StageReader:
    """Collects rows; the ring holds 8 s at 2 ms, so `poll` at least every few seconds."""

    def __init__(self, controller: int, groups: int) -> None:
        self._control = Control(map_region(controller, "control"), groups)
        self._ring = TimingRing(map_region(controller, "timings"))
        self._next = self._control[Word.CONTROLLER_TICK]
        self.rows: list[tuple[int, ...]] = []
        self.missed = 0

    def poll(self) -> None:
        """Takes what has come since the last time; the newest row may be half written and is left for the next."""
        last = self._control[Word.CONTROLLER_TICK]
        rows = self._ring.read(self._next, last)
        self.missed += max(0, last - self._next) - len(rows)
        self.rows += rows
        self._next = max(self._next, last)

    def distributions(self) -> dict[str, Distribution]:
        """Microseconds by stage, and `all` for their sum, over the ticks that were executed."""
        executed = [row for row in self.rows if not row[_SKIPPED]]
        columns = {stage: [row[_FIRST_STAGE + i] / 1e3 for row in executed] for i, stage in enumerate(STAGES)}
        columns["all"] = [sum(row[_FIRST_STAGE:_SKIPPED]) / 1e3 for row in executed]
        return {stage: Distribution.of(values) for stage, values in columns.items()}
