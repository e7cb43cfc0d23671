"""A long run: does any process grow, does the grid drift?"""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from processes import Usage
from report import Report

from axisync_schemas.ticks import Records
from support.daemon import patient

SETTLING_S = 20.0
"""Before the first look: caches fill, pages are touched."""
LOOKS = 20
SWING_DEG = 1.0
"""Moves so short that a thousand of them, which front remembers, are over in some ten minutes."""
ROTATE_MIN = 5
"""Log files so short that the recorder begins several: what it holds of one must be gone with it."""


def cell(text: str) -> str:
    """The cell file of a soak, which is about what grows and drifts: drives wait longer, so that a pause of the machine
    does not end it.
    """
    short, count = re.subn(r"(?m)^rotate_after_min *=.*$", f"rotate_after_min = {ROTATE_MIN}", patient(text))
    assert count == 1, "the cell file says once how long a log is"
    return short


@dataclass
class Growth:
    """Looks at memory while arms move; `look` gives the processes now."""

    look: Callable[[], list[Usage]]
    seconds: float
    at_s: list[float] = field(default_factory=list)
    memory: dict[str, list[float]] = field(default_factory=dict)
    _began: float = field(default_factory=time.monotonic)

    def poll(self) -> None:
        """Now and then, at most LOOKS times over the run."""
        now = time.monotonic() - self._began
        settling = min(SETTLING_S, self.seconds / 4)
        if now < settling + len(self.at_s) * (self.seconds - settling) / LOOKS:
            return
        self.at_s.append(now)
        for usage in self.look():
            self.memory.setdefault(usage.name, []).append(usage.memory_mib)

    def say(self, report: Report, ticks: Records, period_ns: int) -> None:
        """A row for each process, and one for the grid."""
        lines = []
        for name, sizes in self.memory.items():
            half = len(sizes) // 2
            late, at = sizes[half:], np.array(self.at_s[half : len(sizes)])
            slope = float(np.polyfit(at, late, 1)[0]) * 3600.0 if len(late) > 2 else float("nan")
            lines.append([name, f"{sizes[0]:.1f}", f"{sizes[half]:.1f}", f"{sizes[-1]:.1f}", f"{slope:+.1f}"])
        columns = ["process", "first", "half-way", "last", "an hour, from half-way on"]
        report.table("soak", f"Memory over {self.seconds:g} s, MiB", columns, lines)
        starts = ticks["cycle_start_ns"].astype(np.int64)
        off = starts - starts[0] - (ticks["tick"].astype(np.int64) - int(ticks["tick"][0])) * period_ns
        report.say(f"grid: {len(ticks):,} ticks, off by at most {int(np.abs(off).max())} ns, "
                   f"{int(ticks['skipped'].sum())} skipped")  # fmt: skip
