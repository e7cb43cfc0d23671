"""Ticks of one or more files, in pieces of thousands: in order, each tick once, gaps and restarts known."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_review.errors import LogUnreadable
from axisync_review.log_file import Heading, LogFile, Message, Rows, begin_ns
from axisync_schemas.cell import Cell
from axisync_schemas.ticks import TickError

PIECE_ROWS = 16384
"""11 MB of 12 axes: enough to make numpy's overhead small, little enough for memory and caches."""
CARRY = 4
"""Rows of the piece before that differences of third order need, and one to compare the first of them with."""
GAPS_NAMED = 1000

Column = NDArray[Any]
Progress = Callable[[int, int], None]
"""Called now and then with bytes read and bytes in all."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Ticks first..last that no file has; `log_time_ns` is that of the tick before them."""

    first: int
    last: int
    log_time_ns: int


@dataclass(slots=True)
class Piece:
    """Ticks that follow each other without a gap.

    Attributes:
        carry: rows before them, at most `CARRY`; none after a gap and at a beginning. rows: the new ones.
        session: counts the controller's starts, from 0.
    """

    cell: Cell
    carry: Rows
    rows: Rows
    session: int
    _columns: dict[str, Column] = field(default_factory=dict)

    @property
    def carried(self) -> int:
        """Rows at the beginning that are not new."""
        return len(self.carry)

    @property
    def new(self) -> int:
        """Rows that are new."""
        return len(self.rows)

    def column(self, name: str) -> Column:
        """A field of all rows, carried ones first: [carried + new, ...], contiguous."""
        if name not in self._columns:
            parts = [_of(part, name) for part in (self.carry, self.rows)]
            self._columns[name] = np.concatenate(parts)
        return self._columns[name]

    def fresh(self, name: str) -> Column:
        """A field of the new rows."""
        values: Column = self.column(name)[self.carried :]
        return values


def _of(rows: Rows, name: str) -> Column:
    values: Column = rows[name] if name == "log_time" else rows["record"][name]
    return values


class Run:
    """Files of one run of a service, or of several: iterate once.

    Attributes:
        cell, heading: of the first file.
        files: as read, with their damage.
        gaps: at most `GAPS_NAMED` of them; missing: ticks in all gaps.
        duplicates: ticks that came again and were left out.
        off_grid: ticks whose instant is not on the grid of the tick before; the first ones.
        sessions: how often the controller began to count.
    """

    def __init__(self, paths: Sequence[Path], progress: Progress | None = None) -> None:
        """
        Raises:
            LogUnreadable: no file, or one that cannot be opened.
        """
        self.files = [LogFile(path) for path in in_order(paths)]
        self.gaps: list[Gap] = []
        self.missing = self.duplicates = self.off_grid = self.sessions = self.ticks = 0
        self._total = sum(file.path.stat().st_size for file in self.files)
        self._progress = progress
        self._last: np.void | None = None
        self._carry: Rows | None = None

    @property
    def heading(self) -> Heading:
        """Of the first file."""
        return self.files[0].head()

    @property
    def cell(self) -> Cell:
        """Of the first file."""
        return self.heading.cell

    def parts(self, ticks: bool = True) -> Iterator[Piece | Message]:
        """Pieces, and messages of other topics.

        Raises:
            LogUnreadable: a file cannot be read, or is of another cell than the first.
        """
        done = 0
        for file in self.files:
            block: list[memoryview] = []
            octets = enough = 0
            for part in file.parts(ticks):
                if isinstance(part, Message):
                    yield part
                    continue
                if not block:
                    self._check_cell(file)
                    self._tell(done + file.position)
                    enough = PIECE_ROWS * self.heading.row.itemsize
                block.append(part)
                octets += part.nbytes
                if octets >= enough:
                    yield from self._pieces(block)
                    block, octets = [], 0
            self._check_cell(file)
            yield from self._pieces(block)
            done += file.size
            self._tell(done)

    def _tell(self, done: int) -> None:
        if self._progress is not None:
            self._progress(done, self._total)

    def _check_cell(self, file: LogFile) -> None:
        theirs, ours = file.head(), self.heading
        if theirs.cell.name != ours.cell.name or theirs.layout.dtype != ours.layout.dtype:
            raise LogUnreadable(
                f"{self.files[0].path} is of cell {ours.cell.name!r} and {file.path} of cell {theirs.cell.name!r}: "
                "logs of two cells",
                "give the files of one cell at a time",
            )

    def _pieces(self, block: list[memoryview]) -> Iterator[Piece]:
        """Cuts rows where ticks do not follow each other."""
        if not block:
            return
        rows: Rows = np.frombuffer(b"".join(block), dtype=self.heading.row)
        try:
            # Schema, sizes and the chunks' checksums have been compared; one record in each block is enough.
            self.heading.layout.check(np.ascontiguousarray(rows["record"][:1]))
        except TickError as error:
            raise LogUnreadable(f"{self.files[0].path}: {error}") from None
        tick, start = (rows["record"][name].astype(np.int64) for name in ("tick", "cycle_start_ns"))
        step, span = np.diff(tick), np.diff(start)
        cuts = np.flatnonzero((step != 1) | (span != self.cell.period_ns)) + 1
        for begin, end in zip([0, *cuts], [*cuts, len(rows)], strict=True):
            piece = self._place(rows[begin:end])
            if piece is not None:
                yield piece

    def _place(self, rows: Rows) -> Piece | None:
        """A stretch of rows after what came before: is it the next, a repetition, after a gap, or a new start?"""
        period, last = self.cell.period_ns, self._last
        if last is None:
            return self._begin(rows)
        tick, before = int(rows["record"]["tick"][0]), int(last["record"]["tick"])
        away = int(rows["record"]["cycle_start_ns"][0]) - int(last["record"]["cycle_start_ns"])
        on_grid = away == (tick - before) * period
        if tick <= before and not on_grid:
            return self._begin(rows)
        if tick <= before:
            again = min(before - tick + 1, len(rows))
            self.duplicates += again
            return self._place(rows[again:]) if again < len(rows) else None
        if not on_grid:
            self.off_grid += 1
        if tick != before + 1:
            self._gap(before + 1, tick - 1, int(last["log_time"]))
            return self._piece(rows, rows[:0])
        return self._piece(rows, self._carry if on_grid and self._carry is not None else rows[:0])

    def _begin(self, rows: Rows) -> Piece:
        self.sessions += 1
        return self._piece(rows, rows[:0])

    def _piece(self, rows: Rows, carry: Rows) -> Piece:
        self.ticks += len(rows)
        self._last = rows[-1].copy()
        self._carry = np.concatenate([carry, rows[-CARRY:]])[-CARRY:].copy()
        return Piece(self.cell, carry, rows, self.sessions - 1)

    def _gap(self, first: int, last: int, log_time_ns: int) -> None:
        self.missing += last - first + 1
        if len(self.gaps) < GAPS_NAMED:
            self.gaps.append(Gap(first, last, log_time_ns))


def in_order(paths: Sequence[Path]) -> list[Path]:
    """Files in the order of their first instants: names of one cell sort by UTC time, the rest as they were given.

    Raises:
        LogUnreadable: a file is not there, or is given twice.
    """
    for path in paths:
        if not path.is_file():
            reason = "is a directory" if path.is_dir() else "does not exist"
            raise LogUnreadable(f"{path} {reason}")
    if len({path.resolve() for path in paths}) != len(paths):
        raise LogUnreadable("one log is given twice")
    return sorted(paths, key=_begin_of)


def _begin_of(path: Path) -> tuple[int, int, str]:
    """Of files opened at one instant the second one's name is longer, by its number."""
    return begin_ns(path), len(path.name), path.name
