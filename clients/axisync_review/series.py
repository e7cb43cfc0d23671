"""Curves for pictures: least and greatest value of each bucket of ticks, however long the log is.

Buckets hold one tick at first; whenever there are too many, neighbours are joined. Memory stays bounded, and no peak
is lost.
"""

import numpy as np
from numpy.typing import NDArray

from axisync_review.pieces import Column, Piece
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]

BUCKETS = 8192
"""At most; at least half of it in a log with more ticks than that."""


class Envelope:
    """Least and greatest of `columns` values over buckets of `ticks` ticks each, the last one partly filled."""

    def __init__(self, columns: int) -> None:
        self.low, self.high = np.empty((2 * BUCKETS, columns)), np.empty((2 * BUCKETS, columns))

    def extend(self, at: int, values: Array, starts: NDArray[np.intp], open_bucket: bool) -> None:
        """Buckets from number `at` on, of values cut at `starts`; the first goes on with the one that is open."""
        low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
        if open_bucket:
            low[0] = np.minimum(low[0], self.low[at])
            high[0] = np.maximum(high[0], self.high[at])
        self.low[at : at + len(low)], self.high[at : at + len(high)] = low, high

    def halve(self, count: int) -> None:
        """Joins neighbours."""
        even = count // 2
        for values, join in ((self.low, np.minimum), (self.high, np.maximum)):
            joined = join(values[0 : 2 * even : 2], values[1 : 2 * even : 2])
            rest = values[2 * even : count].copy()
            values[:even], values[even : even + len(rest)] = joined, rest


class Series:
    """Envelopes of several quantities over the same buckets, and one sample of all positions in each.

    Attributes:
        ticks: ticks a bucket; count: buckets so far.
    """

    def __init__(self, cell: Cell) -> None:
        n = len(cell.axes)
        names = ("position", "velocity", "acceleration", "jerk", "following_error")
        self.envelopes = {name: Envelope(n) for name in names} | {"lateness": Envelope(1)}
        self.ticks, self.count = 1, 0
        self._filled = 0
        self._times = np.empty(2 * BUCKETS, dtype=np.int64)
        self._poses = np.empty((2 * BUCKETS, n))
        self._states = np.empty((2 * BUCKETS, len(cell.groups)), dtype=np.uint32)

    @property
    def times_ns(self) -> NDArray[np.int64]:
        """[count] wall time of each bucket's first tick."""
        return self._times[: self.count]

    @property
    def poses(self) -> Array:
        """[count, n] positions at each bucket's first tick."""
        return self._poses[: self.count]

    @property
    def states(self) -> NDArray[np.uint32]:
        """[count, g] group states at each bucket's first tick."""
        return self._states[: self.count]

    def envelope(self, name: str) -> tuple[Array, Array]:
        """[count, n] least and greatest."""
        one = self.envelopes[name]
        return one.low[: self.count], one.high[: self.count]

    def take(self, piece: Piece, following_error: Column) -> None:
        """Adds the new rows, a part at a time that surely fits."""
        error = np.zeros((piece.new, following_error.shape[1]))
        part = following_error[-piece.new :]
        error[piece.new - len(part) :] = part
        columns = {name: piece.fresh(name) for name in ("position", "velocity", "acceleration", "jerk")}
        columns |= {"following_error": error, "lateness": piece.fresh("lateness_ns")[:, np.newaxis].astype(np.float64)}
        states = piece.fresh("group_state")
        begin = 0
        while begin < piece.new:
            end = min(piece.new, begin + BUCKETS * self.ticks)
            rows = slice(begin, end)
            self._part(
                {name: values[rows] for name, values in columns.items()}, piece.fresh("log_time")[rows], states[rows]
            )
            begin = end

    def _part(self, columns: dict[str, Array], times: Column, states: Column) -> None:
        room = (self.ticks - self._filled) % self.ticks
        open_bucket = room > 0
        at = self.count - 1 if open_bucket else self.count
        starts = np.concatenate([[0], np.arange(room if open_bucket else self.ticks, len(times), self.ticks)])
        for name, values in columns.items():
            self.envelopes[name].extend(at, values, starts, open_bucket)
        firsts = starts[1:] if open_bucket else starts
        new = slice(self.count, self.count + len(firsts))
        self._times[new], self._poses[new], self._states[new] = (
            times[firsts],
            columns["position"][firsts],
            states[firsts],
        )
        self.count = at + len(starts)
        self._filled = (self._filled + len(times)) % self.ticks
        while self.count > BUCKETS:
            self._halve()

    def _halve(self) -> None:
        if self.count % 2:  # The last bucket has no neighbour yet: it is open, whatever it held.
            self._filled = self._filled or self.ticks
        elif self._filled:
            self._filled += self.ticks
        for envelope in self.envelopes.values():
            envelope.halve(self.count)
        half = (self.count + 1) // 2
        for values in (self._times, self._poses, self._states):
            values[:half] = values[0 : self.count : 2].copy()
        self.count, self.ticks = half, 2 * self.ticks
        self._filled %= self.ticks
