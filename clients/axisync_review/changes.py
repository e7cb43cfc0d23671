"""What changed from tick to tick: states of groups and drives, and which plans were played when."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_review.pieces import Piece
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState

ALL_BITS = 0xFFFFFFFF
KEPT = 20_000
"""Changes of each kind; a log that has more of them is reported with those that came first."""
STATE_BITS = 0x6F
"""Bits of a statusword that tell the state (CiA 402-2, 6.4: mask x1xx 1111)."""
_DRIVE_STATES = {
    0x00: "not ready to switch on", 0x20: "not ready to switch on",
    0x40: "switch on disabled", 0x60: "switch on disabled",
    0x21: "ready to switch on", 0x23: "switched on", 0x27: "operation enabled", 0x07: "quick stop active",
    0x0F: "fault reaction active", 0x2F: "fault reaction active", 0x08: "fault", 0x28: "fault",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Change:
    """A group's or a drive's state became another one at a tick."""

    session: int
    tick: int
    log_time_ns: int
    index: int
    before: int
    after: int


@dataclass(slots=True)
class Played:
    """A plan as one group played it: ticks first..last carry its id.

    Attributes:
        slowed_tick: first tick that a stop slowed; least_rate, path_s: the least and last values of the path clock.
        end_position: [axes of the group] setpoints at the first tick after it; None where the log ends before.
    """

    session: int
    plan_id: int
    group: int
    first_tick: int
    last_tick: int
    begin_ns: int
    end_ns: int
    path_s: float = 0.0
    slowed_tick: int | None = None
    end_position: NDArray[np.float64] | None = None


@dataclass(slots=True)
class Changes:
    """Collected piece by piece."""

    cell: Cell
    groups: list[Change] = field(default_factory=list)
    drives: list[Change] = field(default_factory=list)
    played: list[Played] = field(default_factory=list)
    _open: dict[int, Played] = field(default_factory=dict)
    _before: dict[str, NDArray[Any]] = field(default_factory=dict)

    def take(self, piece: Piece) -> None:
        """Goes through the new rows."""
        self._states(piece, "group_state", self.groups, ALL_BITS)
        self._states(piece, "statusword", self.drives, STATE_BITS)
        for group in range(len(self.cell.groups)):
            self._plans(piece, group)

    def _states(self, piece: Piece, name: str, found: list[Change], mask: int) -> None:
        values = piece.fresh(name) & np.uint32(mask)
        before = self._before.get(name)
        above = values[:1] if before is None else before  # after a gap or a restart: what was last seen
        steps = np.concatenate([above, values])
        self._before[name] = values[-1:].copy()
        for row, index in np.argwhere(steps[1:] != steps[:-1]):
            if len(found) >= KEPT:
                return
            tick, time = int(piece.fresh("tick")[row]), int(piece.fresh("log_time")[row])
            before_it, after_it = int(steps[row, index]), int(values[row, index])
            found.append(Change(piece.session, tick, time, int(index), before_it, after_it))

    def _plans(self, piece: Piece, group: int) -> None:
        ids = piece.fresh("plan_id")[:, group]
        cuts = np.flatnonzero(np.diff(ids)) + 1
        for begin, end in zip([0, *cuts], [*cuts, len(ids)], strict=True):
            self._stretch(piece, group, int(ids[begin]), int(begin), int(end))

    def _stretch(self, piece: Piece, group: int, plan_id: int, begin: int, end: int) -> None:
        tick, time = piece.fresh("tick"), piece.fresh("log_time")
        playing = self._open.get(group)
        if playing is not None and (playing.plan_id != plan_id or playing.session != piece.session):
            self._close(piece, playing, begin)
        if plan_id == 0:
            return
        playing = self._open.get(group)
        if playing is None:
            if len(self.played) >= KEPT:
                return
            first = int(tick[begin])
            playing = Played(piece.session, plan_id, group, first, first, int(time[begin]), int(time[begin]))
            self._open[group] = playing
            self.played.append(playing)
        playing.last_tick, playing.end_ns = int(tick[end - 1]), int(time[end - 1])
        playing.path_s = float(piece.fresh("path_s")[end - 1, group])
        if playing.slowed_tick is None:
            slow = np.flatnonzero(piece.fresh("group_state")[begin:end, group] == GroupState.STOPPING)
            playing.slowed_tick = int(tick[begin + slow[0]]) if len(slow) else None

    def _close(self, piece: Piece, playing: Played, row: int) -> None:
        del self._open[playing.group]
        if playing.session == piece.session and int(piece.fresh("tick")[row]) == playing.last_tick + 1:
            axes = list(self.cell.axis_indices(self.cell.group_names[playing.group]))
            playing.end_position = piece.fresh("position")[row, axes].copy()


def drive_state(statusword: int) -> str:
    """The state that a statusword's bits tell, in CiA 402's words."""
    return _DRIVE_STATES.get(statusword & STATE_BITS, f"unknown ({statusword & STATE_BITS:#04x})")


def group_state(value: int) -> str:
    """A group's state in words."""
    return GroupState(value).label if value in set(GroupState) else f"unknown ({value})"
