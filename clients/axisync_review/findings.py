"""One pass over a log: everything that a review, its pictures and `why` need."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from axisync_review.ahead import ahead
from axisync_review.changes import Changes
from axisync_review.limits import LimitUse
from axisync_review.log_file import Message
from axisync_review.pieces import Piece, Progress, Run
from axisync_review.series import Series
from axisync_review.story import Story
from axisync_review.timing import FollowingError, Lateness

AHEAD = 2
"""Pieces that are read while one is judged."""


@dataclass(slots=True)
class Findings:
    """What one pass gathered.

    Attributes:
        begin_ns, end_ns: wall times of the first and last tick; of messages where there is no tick; 0 without either.
        series: curves, where they were asked for.
    """

    run: Run
    story: Story
    limits: LimitUse
    lateness: Lateness
    following: FollowingError
    changes: Changes
    series: Series | None
    begin_ns: int = 0
    end_ns: int = 0
    first_tick: int = 0

    def t_s(self, log_time_ns: int) -> float:
        """Seconds since the first tick."""
        return (log_time_ns - self.begin_ns) / 1e9


def gather(paths: Sequence[Path], curves: bool = False, progress: Progress | None = None) -> Findings:
    """Reads the files once, in pieces.

    Raises:
        LogUnreadable: see `Run`.
    """
    run = Run(paths, progress)
    found: Findings | None = None
    story = Story()
    with closing(ahead(_batches(run.parts()), AHEAD)) as batches:
        for part in chain.from_iterable(batches):
            if isinstance(part, Message):
                story.add(part)
            else:
                found = found or _nothing(run, story, curves)
                _take(part, found)
    found = found or _nothing(run, story, curves)
    story.sort()
    _span(found)
    return found


def _batches(parts: Iterator[Piece | Message]) -> Iterator[list[Piece | Message]]:
    """Up to a piece each, with the messages before it."""
    batch: list[Piece | Message] = []
    for part in parts:
        batch.append(part)
        if isinstance(part, Piece):
            yield batch
            batch = []
    yield batch


def _nothing(run: Run, story: Story, curves: bool) -> Findings:
    """Before the first tick: the cell is known from here on."""
    cell = run.cell
    series = Series(cell) if curves else None
    return Findings(run, story, LimitUse(cell), Lateness(), FollowingError(cell), Changes(cell), series)


def _take(piece: Piece, found: Findings) -> None:
    times = piece.fresh("log_time")
    if not found.begin_ns:
        found.begin_ns, found.first_tick = int(times[0]), int(piece.fresh("tick")[0])
    found.end_ns = int(times[-1])
    found.limits.take(piece)
    found.lateness.take(piece)
    errors = found.following.take(piece)
    found.changes.take(piece)
    if found.series is not None:
        found.series.take(piece, errors)


def _span(found: Findings) -> None:
    """Without a tick, the messages' times."""
    if found.begin_ns:
        return
    times = [told.log_time_ns for told in (*found.story.events, *found.story.requests)]
    if times:
        found.begin_ns, found.end_ns = min(times), max(times)
