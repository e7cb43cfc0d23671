"""Two runs of one program compared: move by move in their order, then drives and timing."""

import hashlib
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from axisync_review.errors import LogUnreadable
from axisync_review.findings import Findings, gather
from axisync_review.models import MoveReview
from axisync_review.moves import moves_of
from axisync_review.pieces import Piece, Progress, Run
from axisync_review.playing import path_of
from axisync_schemas.base import Strict
from axisync_schemas.log_models import PlanLog


class MoveDiff(Strict):
    """The n-th move of a group in both runs; None where a run has no such move.

    Attributes:
        same_plan: polynomials equal to the bit; plan_error: greatest distance of the planned positions, rad.
        same_setpoints: every setpoint equal to the bit, and as many of them.
    """

    group: str
    number: int
    move_a: str | None
    move_b: str | None
    status_a: str | None
    status_b: str | None
    planned_a_s: float | None
    planned_b_s: float | None
    same_plan: bool
    plan_error: float | None
    same_setpoints: bool


class AxisDiff(Strict):
    """Following errors of an axis in both runs, rad."""

    axis: str
    rms_a: float
    rms_b: float
    peak_a: float
    peak_b: float


class TimingDiff(Strict):
    """Lateness in both runs, us, and skipped ticks."""

    p50_a: float
    p50_b: float
    p99_a: float
    p99_b: float
    max_a: float
    max_b: float
    skipped_a: int
    skipped_b: int


class Diff(Strict):
    """`same`: the same moves with the same setpoints and results; following errors and timing never are the same."""

    same: bool
    summary: str
    moves: tuple[MoveDiff, ...]
    axes: tuple[AxisDiff, ...]
    timing: TimingDiff


def diff(a: Sequence[Path], b: Sequence[Path], progress: Progress | None = None) -> Diff:
    """Compares two runs.

    Raises:
        LogUnreadable: see `Run`; or the runs are of different cells.
    """
    one, other = gather(a, progress=progress), gather(b, progress=progress)
    if [axis.name for axis in one.run.cell.axes] != [axis.name for axis in other.run.cell.axes]:
        raise LogUnreadable(f"{a[0]} and {b[0]} are of cells with different axes")
    moves = tuple(_moves(one, other, digests(a), digests(b)))
    return Diff(
        same=all(move.same_setpoints and move.status_a == move.status_b for move in moves),
        summary=_summary(moves),
        moves=moves,
        axes=tuple(_axes(one, other)),
        timing=_timing(one, other),
    )


def digests(paths: Sequence[Path]) -> dict[int, bytes]:
    """SHA-256 of the setpoints of each plan, by plan id."""
    run = Run(paths)
    hashes: dict[int, hashlib._Hash] = {}
    for part in run.parts():
        if isinstance(part, Piece):
            for plan_id, rows, axes in _stretches(run, part):
                positions = np.ascontiguousarray(part.fresh("position")[rows][:, axes])
                hashes.setdefault(plan_id, hashlib.sha256()).update(positions.tobytes())
    return {plan_id: one.digest() for plan_id, one in hashes.items()}


def _stretches(run: Run, piece: Piece) -> Iterator[tuple[int, "np.ndarray[tuple[int], np.dtype[np.intp]]", list[int]]]:
    """Plan, rows that play it, and the axes of all groups that do."""
    ids = piece.fresh("plan_id")
    for plan_id in np.unique(ids[ids != 0]).tolist():
        groups = np.flatnonzero((ids == plan_id).any(axis=0))
        axes = [axis for group in groups for axis in run.cell.axis_indices(run.cell.group_names[group])]
        yield plan_id, np.flatnonzero((ids == plan_id).any(axis=1)), axes


def _by_group(found: Findings) -> dict[str, list[MoveReview]]:
    groups: dict[str, list[MoveReview]] = {}
    for move in moves_of(found):
        groups.setdefault(move.group, []).append(move)
    return groups


def _moves(
    one: Findings, other: Findings, digests_a: dict[int, bytes], digests_b: dict[int, bytes]
) -> Iterator[MoveDiff]:
    a, b = _by_group(one), _by_group(other)
    for group in dict.fromkeys([*a, *b]):
        for number, (left, right) in enumerate(zip_longest(a.get(group, []), b.get(group, [])), 1):
            plan_a = one.story.plans.get(left.plan_id) if left else None
            plan_b = other.story.plans.get(right.plan_id) if right else None
            error = plan_error(plan_a, plan_b, one.run.cell.period)
            both = left is not None and right is not None
            yield MoveDiff(
                group=group,
                number=number,
                move_a=left.move_id if left else None,
                move_b=right.move_id if right else None,
                status_a=left.status if left else None,
                status_b=right.status if right else None,
                planned_a_s=left.planned_s if left else None,
                planned_b_s=right.planned_s if right else None,
                same_plan=both and _same_plan(plan_a, plan_b),
                plan_error=error,
                same_setpoints=left is not None
                and right is not None
                and digests_a.get(left.plan_id) == digests_b.get(right.plan_id),
            )


def _same_plan(a: PlanLog | None, b: PlanLog | None) -> bool:
    if a is None or b is None:
        return False
    return (a.knots, a.coefficients, a.start, a.end) == (b.knots, b.coefficients, b.start, b.end)


def plan_error(a: PlanLog | None, b: PlanLog | None, period: float) -> float | None:
    """Greatest distance of positions at the same times since the beginning; None where a plan is missing."""
    if a is None or b is None or not a.knots or not b.knots or a.axes != b.axes:
        return None
    one, other = (path_of(plan) for plan in (a, b))
    times = np.arange(0.0, max(one.duration, other.duration) + period, period)
    return float(np.abs(one.sample(times)[0] - other.sample(times)[0]).max())


def _axes(one: Findings, other: Findings) -> Iterator[AxisDiff]:
    for index, axis in enumerate(one.run.cell.axes):
        yield AxisDiff(
            axis=axis.name,
            rms_a=float(one.following.rms[index]),
            rms_b=float(other.following.rms[index]),
            peak_a=float(one.following.greatest[index]),
            peak_b=float(other.following.greatest[index]),
        )


def _timing(one: Findings, other: Findings) -> TimingDiff:
    a, b = one.lateness, other.lateness
    return TimingDiff(
        p50_a=a.percentile_us(50),
        p50_b=b.percentile_us(50),
        p99_a=a.percentile_us(99),
        p99_b=b.percentile_us(99),
        max_a=a.greatest_ns / 1e3,
        max_b=b.greatest_ns / 1e3,
        skipped_a=a.skipped,
        skipped_b=b.skipped,
    )


def _summary(moves: tuple[MoveDiff, ...]) -> str:
    if not moves:
        return "nothing moved in either run"
    differ = [move for move in moves if not (move.same_setpoints and move.status_a == move.status_b)]
    if not differ:
        return f"the same program: {len(moves)} moves with the same setpoints to the bit, and the same results"
    return f"{len(differ)} of {len(moves)} moves differ; the first is move {differ[0].number} of {differ[0].group}"
