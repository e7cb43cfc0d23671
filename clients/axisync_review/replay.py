"""Every setpoint again, from the logged plans and the ticks at which commands took effect, compared bit for bit.

The controller's own `Motion` plays the plans, so a replay follows whatever path clock the controller has. What stands
keeps its setpoint; what is not enabled follows its actual position, as the controller has it. What nobody here can
replay is counted and said; it is no difference.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_review.effects import Effects, effects_of
from axisync_review.limits import COMMANDED, group_of_axes
from axisync_review.log_file import Message
from axisync_review.pieces import Piece, Progress, Run
from axisync_review.playing import Met, NotReplayable, Playing, begin
from axisync_review.story import Story
from axisync_schemas.base import Strict
from axisync_schemas.cell import Cell
from axisync_schemas.ticks import SIGNIFICAND_BITS, shorten
from axisync_service.mapper.counts import CountMap

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PER_AXIS = ("position", "velocity", "acceleration", "jerk")
SAME_INSTANT_NS = 1_000_000_000
"""Tick numbers begin anew with the controller; an event and a tick of one start are nearer than this."""


class Difference(Strict):
    """The first setpoint that is not what it should be; floats with all their digits."""

    tick: int
    what: str
    logged: str
    replayed: str


class Replay(Strict):
    """What a replay found.

    Attributes:
        ticks: were gone through; not_replayed: of these, how many have setpoints of some group that were not compared,
            `notes` say why. plans: were played again.
    """

    same: bool
    ticks: int
    not_replayed: int
    plans: int
    difference: Difference | None
    notes: tuple[str, ...]


def read_story(paths: Sequence[Path]) -> tuple[Story, Cell]:
    """The JSON messages alone, and the cell.

    Raises:
        LogUnreadable: see `Run`.
    """
    run, story = Run(paths), Story()
    for part in run.parts(ticks=False):
        if isinstance(part, Message):
            story.add(part)
    story.sort()
    return story, run.cell


def replay(paths: Sequence[Path], progress: Progress | None = None) -> Replay:
    """Plays the whole log again, up to the first difference.

    Raises:
        LogUnreadable: see `Run`.
    """
    story, cell = read_story(paths)
    player = Player(cell, story)
    run = Run(paths, progress)
    ticks, difference = 0, None
    for part in run.parts():
        if isinstance(part, Piece):
            difference = player.compare(part)
            if difference is not None:
                break
            ticks += part.new
    notes = list(player.notes)
    if run.missing:
        notes.append(f"{run.missing} ticks are missing in the log and could not be compared")
    return Replay(
        same=difference is None, ticks=ticks, not_replayed=player.not_replayed, plans=player.plans,
        difference=difference, notes=tuple(notes),
    )  # fmt: skip


@dataclass(slots=True)
class _Should:
    """What the new rows of a piece should hold. `free`: [rows, groups] that nobody can say it of."""

    values: dict[str, Array]
    plan_id: NDArray[np.uint64]
    free: Mask


@dataclass(slots=True)
class Player:
    """Goes through a log piece by piece.

    Attributes:
        plans: how many were played again; notes: what could not be. not_replayed: ticks not compared of some group.
    """

    cell: Cell
    story: Story
    plans: int = 0
    not_replayed: int = 0
    notes: list[str] = field(default_factory=list)
    _playing: dict[int, Playing] = field(default_factory=dict)
    _met: set[int] = field(default_factory=set)
    _left_out: set[int] = field(default_factory=set)
    _effects: dict[int, Effects] = field(default_factory=dict)
    _free_before: Mask | None = None
    _session: int = 0

    def __post_init__(self) -> None:
        self._effects = effects_of(self.story)

    def compare(self, piece: Piece) -> Difference | None:
        """The first difference among the new rows, if any."""
        if piece.session != self._session:  # Ticks begin anew, and nothing moves.
            self._session, self._free_before = piece.session, None
            self._playing.clear()
        should = self._standing(piece)
        for plan_id, row in self._new_plans(piece):
            self._begin(piece, plan_id, row)
        for plan_id in list(self._playing):
            self._play(piece, plan_id, should)
        self._leave_out(piece, should)
        for name in SIGNIFICAND_BITS:
            shorten(should.values[name], name)
        return self._first(piece, should)

    # --- what should be -----------------------------------------------------------------------------------------

    def _standing(self, piece: Piece) -> _Should:
        """As if nothing moved: each setpoint that of the tick before, or the actual position where it follows that."""
        position, actual, first = piece.column("position"), piece.column("position_actual"), piece.carried
        if not first:
            position, actual = (np.concatenate([rows[:1], rows]) for rows in (position, actual))
            first = 1
        before, now = position[first - 1 : -1].copy(), position[first:]
        follows = ~np.isin(piece.fresh("group_state"), COMMANDED)[:, group_of_axes(self.cell)]
        follows &= _bits(before) != _bits(now)
        before[follows] = actual[first - 1 : -1][follows]
        values = {"position": before, **{name: np.zeros_like(before) for name in PER_AXIS[1:]}}
        shape = piece.new, len(self.cell.groups)
        values |= {name: np.zeros(shape) for name in ("path_s", "path_rate")}
        return _Should(values, np.zeros(shape, dtype=np.uint64), np.zeros(shape, dtype=bool))

    def _new_plans(self, piece: Piece) -> Iterator[tuple[int, int]]:
        """Plans that these rows are the first to show, by their ids or, where one arrives at once, by its start."""
        ids = piece.fresh("plan_id")
        for plan_id in dict.fromkeys(ids[ids != 0].tolist()):
            if plan_id not in self._met:
                yield plan_id, int((ids == plan_id).any(axis=1).argmax())
        ticks, starts = piece.fresh("tick").astype(np.int64), piece.fresh("cycle_start_ns").astype(np.int64)
        for plan_id, effects in self._effects.items():
            if plan_id in self._met or effects.started is None:
                continue
            row = effects.started + 1 - int(ticks[0])
            if 0 <= row < piece.new and abs(float(starts[row]) - 1e9 * effects.started_s) < SAME_INSTANT_NS:
                yield plan_id, row

    def _begin(self, piece: Piece, plan_id: int, row: int) -> None:
        self._met.add(plan_id)
        group = int((piece.fresh("plan_id")[row] == plan_id).argmax())
        met = Met(
            int(piece.fresh("tick")[row]),
            float(piece.fresh("path_s")[row, group]),
            float(piece.fresh("path_rate")[row, group]),
        )
        try:
            plan, effects = self.story.plans.get(plan_id), self._effects.get(plan_id, Effects())
            self._playing[plan_id] = begin(self.cell, plan, effects, met)
            self.plans += 1
        except NotReplayable as why:
            self._give_up(plan_id, str(why))

    def _give_up(self, plan_id: int, why: str) -> None:
        self._left_out.add(plan_id)
        self._playing.pop(plan_id, None)
        self.notes.append(f"plan {plan_id} {why}: its setpoints were not compared")

    def _play(self, piece: Piece, plan_id: int, should: _Should) -> None:
        playing = self._playing[plan_id]
        ticks = piece.fresh("tick").astype(np.int64)
        for row in range(int(np.searchsorted(ticks, playing.tick + 1)), piece.new):
            while playing.tick < ticks[row] - 1:  # Over a gap in the log.
                playing.advance()
            values = playing.advance()
            unknown = playing.effects.unknown
            if unknown is not None and unknown.tick is not None and unknown.tick < playing.tick:
                self._give_up(plan_id, f"met {unknown.kind!r} at tick {unknown.tick}, which is not replayed")
                return
            if not self._setpoint(piece, row, playing, values, should):
                del self._playing[plan_id]
                return

    def _setpoint(
        self, piece: Piece, row: int, playing: Playing, values: tuple[Array, ...] | None, should: _Should
    ) -> bool:
        """One row of a motion; False when it is over with it."""
        motion, members = playing.motion, list(playing.motion.members)
        if playing.over and (values is None or not motion.at_rest):  # Ended where it was held, or by a fault at once.
            return False
        if values is not None:
            for name, value in zip(PER_AXIS, values, strict=True):
                should.values[name][row, motion.axes] = value
        gone = playing.over or not (piece.fresh("plan_id")[row, members] == motion.plan_id).any()
        if motion.at_rest and (motion.arrived or gone):
            return False
        should.plan_id[row, members] = motion.plan_id
        should.values["path_s"][row, members] = motion.path_s
        should.values["path_rate"][row, members] = motion.rate
        return True

    def _leave_out(self, piece: Piece, should: _Should) -> None:
        """What nobody can say, and the rows after it, in which it comes to its end."""
        free = should.free
        for plan_id in self._left_out:
            free |= piece.fresh("plan_id") == plan_id
        last = free[-1:].copy()
        free[1:] |= free[:-1].copy()
        if self._free_before is not None and piece.carried:
            free[:1] |= self._free_before
        self._free_before = last
        self.not_replayed += int(free.any(axis=1).sum())

    # --- comparing ----------------------------------------------------------------------------------------------

    def _first(self, piece: Piece, should: _Should) -> Difference | None:
        axes_free = should.free[:, group_of_axes(self.cell)]
        differences: list[Difference] = []
        for name, values in should.values.items():
            logged = np.ascontiguousarray(piece.fresh(name))
            wrong = (_bits(logged) != _bits(values)) & ~(axes_free if name in PER_AXIS else should.free)
            differences += self._at(piece, name, wrong, logged, values)
        ids = piece.fresh("plan_id")
        differences += self._at(piece, "plan_id", (ids != should.plan_id) & ~should.free, ids, should.plan_id)
        counts, logged = CountMap(self.cell.axes).to_counts(should.values["position"]), piece.fresh("target_counts")
        wrong = (logged != counts.astype(np.int32)) & ~axes_free
        differences += self._at(piece, "target_counts", wrong, logged, counts)
        return min(differences, key=lambda difference: difference.tick, default=None)

    def _at(
        self, piece: Piece, name: str, wrong: Mask, logged: NDArray[Any], replayed: NDArray[Any]
    ) -> Iterator[Difference]:
        if not wrong.any():
            return
        row, column = (int(i) for i in np.argwhere(wrong)[0])
        of_axes = name in PER_AXIS or name == "target_counts"
        about = self.cell.axes[column].name if of_axes else self.cell.group_names[column]
        yield Difference(
            tick=int(piece.fresh("tick")[row]),
            what=f"{about}: {name}",
            logged=repr(logged[row, column].item()),
            replayed=repr(replayed[row, column].item()),
        )


def _bits(values: NDArray[Any]) -> NDArray[np.int64]:
    """Of each number, but the sign of a zero."""
    return np.ascontiguousarray(values + 0.0, dtype=np.float64).view(np.int64)
