"""How late ticks were, which were skipped, and how far drives were from their setpoints."""

import numpy as np
from numpy.typing import NDArray

from axisync_review.limits import COMMANDED, group_of_axes, in_states, peaks
from axisync_review.pieces import Piece
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]

PER_DECADE = 100
"""Bins of the fine histogram: percentiles are exact to 1.2 %."""
FIRST_NS = 100.0
"""Everything below is one bin, 0.1 us."""
DECADES = 9
EDGES_NS = FIRST_NS * 10.0 ** (np.arange(DECADES * PER_DECADE + 1) / PER_DECADE)


class Lateness:
    """A histogram of logarithmic bins, so that its size does not depend on the log's. Skipped ticks are not in it.

    Attributes:
        skipped, skipped_in_a_row: all of them, and the most in a row; skipped_commanded: the most in a row while any
            group was commanded, which is what drives must bear.
    """

    def __init__(self) -> None:
        self.counts = np.zeros(len(EDGES_NS) + 1, dtype=np.int64)
        self.greatest_ns = 0
        self.greatest_tick = 0
        self.skipped = 0
        self.skipped_in_a_row = 0
        self.skipped_commanded = 0
        self._running = self._running_commanded = 0

    def take(self, piece: Piece) -> None:
        """Counts the new rows."""
        lateness, skipped = piece.fresh("lateness_ns"), piece.fresh("skipped") != 0
        values, ticks = lateness, piece.fresh("tick")
        if skipped.any():
            self._skips(piece, skipped)
            values, ticks = values[~skipped], ticks[~skipped]
        else:
            self._running = self._running_commanded = 0
        if not len(values):
            return
        self.counts += np.bincount(np.searchsorted(EDGES_NS, values, side="right"), minlength=len(self.counts))
        worst = int(values.argmax())
        if values[worst] > self.greatest_ns:
            self.greatest_ns, self.greatest_tick = int(values[worst]), int(ticks[worst])

    def _skips(self, piece: Piece, skipped: NDArray[np.bool_]) -> None:
        self.skipped += int(skipped.sum())
        most, self._running = _longest(skipped, self._running)
        self.skipped_in_a_row = max(self.skipped_in_a_row, most)
        commanded = in_states(piece.fresh("group_state"), COMMANDED).any(axis=1)
        most, self._running_commanded = _longest(skipped & commanded, self._running_commanded)
        self.skipped_commanded = max(self.skipped_commanded, most)

    def percentile_us(self, percent: float) -> float:
        """Upper edge of the bin in which it lies; never above the greatest."""
        total = self.counts.sum()
        if not total:
            return 0.0
        index = int(np.searchsorted(np.cumsum(self.counts), percent / 100 * total))
        edge = EDGES_NS[min(index, len(EDGES_NS) - 1)]
        return min(float(edge), float(self.greatest_ns)) / 1e3

    def bars(self, per_decade: int = 10) -> tuple[list[float], list[int]]:
        """Lower edges (us, 0 first) and counts of coarse bins, without empty ones at the ends."""
        step = PER_DECADE // per_decade
        counts = np.concatenate([self.counts[:1], np.add.reduceat(self.counts[1:], np.arange(0, len(EDGES_NS), step))])
        edges = np.concatenate([[0.0], EDGES_NS[::step]]) / 1e3
        filled = np.flatnonzero(counts)
        if not len(filled):
            return [], []
        span = slice(int(filled[0]), int(filled[-1]) + 1)
        return edges[span].tolist(), counts[span].tolist()


def _longest(flags: NDArray[np.bool_], running: int) -> tuple[int, int]:
    """Most flags in a row, `running` of them before these; and how many in a row there are at the end."""
    clear = np.flatnonzero(~flags)
    if not len(clear):
        return running + len(flags), running + len(flags)
    last = len(flags) - 1 - int(clear[-1])
    inner = int(np.diff(clear).max()) - 1 if len(clear) > 1 else 0
    return max(running + int(clear[0]), inner, last), last


class FollowingError:
    """Setpoint in force at a SYNC minus the sample taken at it, which the record of the next tick holds.

    Attributes:
        greatest: [n] rad; mean_square over `samples` [n].
    """

    def __init__(self, cell: Cell) -> None:
        self._group = group_of_axes(cell)
        n = len(cell.axes)
        self.greatest, self.tick = np.zeros(n), np.zeros(n, dtype=np.int64)
        self._squares, self._samples = np.zeros(n), np.zeros(n, dtype=np.int64)

    @property
    def rms(self) -> Array:
        """[n] rad; 0 where nothing was measured."""
        rms: Array = np.sqrt(self._squares / np.maximum(self._samples, 1))
        return rms

    def take(self, piece: Piece) -> Array:
        """[rows - 1, n] errors, for curves: 0 where a group is not commanded, the last one over skipped ticks."""
        errors: Array = piece.column("position")[:-1] - piece.column("position_actual")[1:]
        if not np.isfinite(errors.sum()):  # Told of as a limit; here it would spoil the rest.
            errors = np.nan_to_num(errors, posinf=0.0, neginf=0.0)
        commanded = in_states(piece.column("group_state"), COMMANDED)
        commanded = commanded[1:] & commanded[:-1]
        if not commanded.all():
            errors *= commanded[:, self._group]
        skipped = piece.column("skipped") != 0
        known = ~(skipped[1:] | skipped[:-1])
        self._measure(piece, errors, commanded & known[:, np.newaxis])
        if not known.all():
            errors = errors[np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))]
        return errors

    def _measure(self, piece: Piece, errors: Array, good: NDArray[np.bool_]) -> None:
        """Peaks and squares of the new rows of `errors` where `good` [rows - 1, g]."""
        first = max(0, piece.carried - 1)
        values = np.abs(errors[first:])
        if not good[first:].all():
            values *= good[first:][:, self._group]
        here = peaks(values)
        for axis in np.flatnonzero(here > self.greatest):
            self.greatest[axis] = here[axis]
            self.tick[axis] = piece.column("tick")[first + int(values[:, axis].argmax())]
        self._squares += np.einsum("ij,ij->j", values, values)
        self._samples += good[first:].sum(axis=0)[self._group]
