"""500 ticks a second are more than a plot shows: a few samples a frame, none of the peaks lost."""

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from axisync_client import Setpoints

WINDOW_S = 0.025
"""One sample of the plots for so much time."""
LATENESS_EDGES_US = (0.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0)
"""Lower edges of the histogram's bins; the last one is open."""
HISTOGRAM_S = 10.0

Array = NDArray[np.float64]
Sample = tuple[float, list[list[float | None]]]
"""Daemon's time, s, and for each of QUANTITIES the values of all axes."""
QUANTITIES = ("position", "velocity", "acceleration", "jerk", "error", "actual")


@dataclass
class Decimator:
    """Takes batches, gives samples: of positions the last of a window, of everything else the value farthest from 0."""

    _window: int = -1
    _last: Array | None = None
    _peaks: Array | None = None
    _previous: Array | None = None

    def add(self, batch: Setpoints) -> list[Sample]:
        """The samples whose windows this batch completes."""
        values = self._values(batch)
        samples: list[Sample] = []
        for window, rows in _windows(batch.time_s):
            if window != self._window:
                if self._last is not None:
                    samples.append(self._sample())
                self._window, self._peaks = window, None
            self._take(values[:, rows])
        return samples

    def _values(self, batch: Setpoints) -> Array:
        """[6, m, n] in the order of QUANTITIES. The sample known at tick k was taken at SYNC k-1."""
        before = batch.position[:1] if self._previous is None else self._previous[None]
        demand = np.concatenate([before, batch.position[:-1]])
        self._previous = batch.position[-1].copy()
        error = demand - batch.position_actual
        return np.stack([batch.position, batch.velocity, batch.acceleration, batch.jerk, error, batch.position_actual])

    def _take(self, values: Array) -> None:
        self._last = values[:, -1]
        together = values if self._peaks is None else np.concatenate([self._peaks[:, None], values], axis=1)
        rows = np.argmax(np.abs(np.nan_to_num(together)), axis=1)
        self._peaks = np.take_along_axis(together, rows[:, None], axis=1)[:, 0]

    def _sample(self) -> Sample:
        assert self._last is not None
        assert self._peaks is not None
        rows = [self._last[0], *self._peaks[1:5], self._last[5]]
        return round(self._window * WINDOW_S, 3), [rounded(row) for row in rows]


def _windows(time_s: Array) -> list[tuple[int, slice]]:
    """Number of each window, and its rows."""
    numbers = np.floor(time_s / WINDOW_S).astype(np.int64)
    cuts = np.flatnonzero(np.diff(numbers)) + 1
    edges = [0, *cuts.tolist(), len(numbers)]
    return [(int(numbers[a]), slice(a, b)) for a, b in pairwise(edges) if b > a]


def rounded(row: Array) -> list[float | None]:
    """As JSON takes them: five digits after the point are a tenth of an encoder count of the demo; NaN is null."""
    return [round(value, 6) if math.isfinite(value) else None for value in row.tolist()]


@dataclass
class Histogram:
    """Lateness of the ticks of the last ten seconds, in bins of `LATENESS_EDGES_US`."""

    _seconds: list[tuple[int, NDArray[np.int64]]] = field(default_factory=list)

    def add(self, batch: Setpoints) -> None:
        """Counts the ticks that were not skipped."""
        if not len(batch):
            return
        late = batch.records["lateness_ns"][~batch.skipped] / 1e3
        edges = [-np.inf, *LATENESS_EDGES_US[1:], np.inf]
        counts, _ = np.histogram(late, edges)
        second = int(batch.time_s[-1])
        if self._seconds and self._seconds[-1][0] == second:
            self._seconds[-1] = (second, self._seconds[-1][1] + counts)
        else:
            self._seconds = [item for item in self._seconds if second - HISTOGRAM_S < item[0] <= second]
            self._seconds.append((second, counts))

    def counts(self) -> list[int]:
        """Ticks in each bin."""
        total = np.zeros(len(LATENESS_EDGES_US), dtype=np.int64)
        for _, counts in self._seconds:
            total += counts
        return [int(count) for count in total]
