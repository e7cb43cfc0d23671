"""How much of the limits a log used, judged on differences of the logged positions and on the logged derivatives.

For a motion whose k-th derivative is bounded by B, the k-th difference over T^k is a mean of that derivative, so it is
bounded by B too, whatever the sampling; what remains is rounding, amplified by T^-k.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_review.pieces import CARRY, Piece
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import SIGNIFICAND_BITS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

QUANTITIES = ("velocity", "acceleration", "jerk")
"""Derivatives of first, second and third order."""
COMMANDED = (GroupState.STANDSTILL, GroupState.MOVING, GroupState.HELD, GroupState.STOPPING, GroupState.JOGGING)
"""States in which the setpoint is the service's own; in the others it may follow the actual position."""
AT_REST = (GroupState.STANDSTILL, GroupState.HELD)
EPSILON = float(np.finfo(np.float64).eps)
ROUNDING = 4.0
"""Errors of a position in units of eps |q|: Horner's rule, and the path parameter as a sum of periods."""
CUT = np.array([2.0 ** -SIGNIFICAND_BITS[name] for name in QUANTITIES])
"""Error of a logged derivative, in units of itself."""
_WIDE = 64
_STATES = 256
"""A log may hold states of a later version; none of them is one of these."""
LOGGED = 1.0 + 1e-6
"""Allowance for derivatives while the rate changes: the path clock keeps limits where it expects a tick to end."""
BETWEEN = 1.01
"""The same for jerk in the middle of a tick, of which only the ends are watched."""


@dataclass(frozen=True, slots=True)
class Excess:
    """The worst of one kind on one axis: `value` where `allowed` was allowed."""

    axis: int
    what: str
    tick: int
    log_time_ns: int
    value: float
    allowed: float


def group_of_axes(cell: Cell) -> NDArray[np.intp]:
    """[n] the elementary group of each axis."""
    return np.concatenate([np.full(len(group.axes), index) for index, group in enumerate(cell.groups)])


def bounds(cell: Cell) -> tuple[Array, Array]:
    """[3, n] limits of velocity, acceleration, jerk: of moves, and while stopping."""
    moving = np.array([[getattr(axis.limits, name) for axis in cell.axes] for name in QUANTITIES])
    stopping = moving.copy()
    stopping[1:] = [[getattr(axis.stop_limits, name) for axis in cell.axes] for name in QUANTITIES[1:]]
    return moving, stopping


class Slowing:
    """Ticks that end slower than they began because of a stop or a hold, so that they may use the stop limits.

    The tick in which a group comes to rest is one of them, although its state is another one at its end; and so are
    those after a resume in which the rate still falls as the stop made it.
    """

    def __init__(self) -> None:
        self._before: Mask | None = None

    def of(self, piece: Piece) -> Mask:
        """[rows, groups], carried rows too."""
        stopping: Mask = piece.column("group_state") == GroupState.STOPPING
        rate, plan = piece.column("path_rate"), piece.column("plan_id")
        falls = np.zeros_like(stopping)
        falls[1:] = (rate[1:] < rate[:-1]) & (plan[1:] == plan[:-1])
        known = piece.carried if self._before is not None else 0
        slow = stopping.copy()
        if known and self._before is not None:
            slow[:known] = self._before[-known:]
        goes_on = stopping | falls
        row = np.arange(len(slow))[:, np.newaxis]
        begun = np.maximum.accumulate(np.where(slow | stopping, row, -1), axis=0)
        broken = np.maximum.accumulate(np.where(goes_on, -1, row), axis=0)
        slow[known:] |= (falls & (begun > broken))[known:]
        first = max(known, 1)
        slow[first:] |= stopping[first - 1 : -1]
        self._before = slow[-CARRY:].copy()
        return slow


def in_states(state: NDArray[np.uint32], which: tuple[GroupState, ...]) -> Mask:
    """Where a group's state is one of these. As np.isin, in a tenth of its time."""
    table = np.zeros(_STATES, dtype=np.bool_)
    table[list(which)] = True
    found: Mask = table.take(state, mode="clip")
    return found


def thin(mask: Mask) -> Mask:
    """[n] where all rows of [rows, n] are alike, as they mostly are; else as it is."""
    return mask[0] if len(mask) and bool((mask == mask[0]).all()) else mask


def rows_of(mask: Mask, rows: slice) -> Mask:
    """Some rows of a mask, which may be thin."""
    return mask if mask.ndim == 1 else mask[rows]


def peaks(values: Array, mask: Mask | None = None) -> Array:
    """[rows, n] -> [n]: greatest of each column, 0 where there is no row. In wide rows, as numpy is fast with them.

    What is not in `mask`, which may be thin, counts as 0.
    """
    if mask is not None and mask.ndim == 2:
        values = values * mask
    rows, n = values.shape
    wide = rows // _WIDE * _WIDE
    parts = values[wide:]
    if wide:
        parts = np.concatenate([values[:wide].reshape(-1, _WIDE * n).max(axis=0).reshape(_WIDE, n), parts])
    greatest: Array = parts.max(axis=0) if len(parts) else np.zeros(n)
    return greatest * mask if mask is not None and mask.ndim == 1 else greatest


class LimitUse:
    """Peaks, piece by piece.

    Attributes:
        moving, stopping: [3, n] greatest differences of order 1, 2, 3, in SI units.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell, self._period = cell, cell.period
        self._group = group_of_axes(cell)
        self.limits, self.stop_limits = bounds(cell)
        n = len(cell.axes)
        self.moving, self.stopping = np.zeros((3, n)), np.zeros((3, n))
        self._slowing = Slowing()
        self._hard = np.array([axis.hard_limits for axis in cell.axes]).T
        self._worst: dict[tuple[int, str], Excess] = {}

    @property
    def excesses(self) -> list[Excess]:
        """What was over a limit, by axis."""
        return [self._worst[key] for key in sorted(self._worst)]

    def take(self, piece: Piece) -> None:
        """Judges every window of samples that ends in a new row."""
        state = piece.column("group_state")
        commanded = thin(in_states(state, COMMANDED))[..., self._group]
        stopping = thin(self._slowing.of(piece))[..., self._group]
        position = piece.column("position")
        if not np.isfinite(position).all():
            row, axis = np.argwhere(~np.isfinite(position))[0]
            self._note(piece, int(axis), "position, which must be a number,", int(row), float("nan"), 0.0)
            return
        size = np.maximum(peaks(np.abs(position)), 1.0)
        self._differences(piece, position, size, commanded, stopping)
        self._logged(piece, position, size, commanded, stopping)
        self._rest(piece, position, state)
        self._hard_limits(piece, position, commanded)

    # --- differences of positions -------------------------------------------------------------------------------

    def _differences(self, piece: Piece, position: Array, size: Array, commanded: Mask, stopping: Mask) -> None:
        differences, judged, slow = position, commanded, stopping
        for order, name in enumerate(QUANTITIES, 1):
            differences = differences[1:] - differences[:-1]
            earlier = slice(None, -order)
            judged = rows_of(judged, slice(1, None)) & rows_of(commanded, earlier)
            slow = rows_of(slow, slice(1, None)) | rows_of(stopping, earlier)
            new = slice(max(0, piece.carried - order), None)
            rounding = 2.0**order * ROUNDING * EPSILON * size / self._period**order
            what = f"{name} by differences of positions"
            self._peaks(
                piece, order, np.abs(differences[new]), (rows_of(judged, new), rows_of(slow, new)), rounding, what
            )

    def _peaks(
        self, piece: Piece, order: int, values: Array, masks: tuple[Mask, Mask], rounding: Array, what: str
    ) -> None:
        """Peaks of windows that touch a stop, and of the others, each against its own limits.

        `values` are T^order times a derivative; `masks`: those that are judged, and that touch a stop.
        """
        if not len(values):
            return
        row, (judged, slow) = order - 1, masks
        self._compare(
            piece, order, values, judged & ~slow, LOGGED * self.limits[row] + rounding, self.moving[row], what
        )
        if slow.any():
            allowed = LOGGED * self.stop_limits[row] + rounding
            self._compare(piece, order, values, judged & slow, allowed, self.stopping[row], f"{what} while stopping")

    def _compare(
        self, piece: Piece, order: int, values: Array, mask: Mask, allowed: Array, greatest: Array, what: str
    ) -> None:
        here = peaks(values, mask) * self._period**-order
        np.maximum(greatest, here, out=greatest)
        for axis in np.flatnonzero(here > allowed):
            row = int((values[:, axis] * mask[..., axis]).argmax())
            self._note(piece, int(axis), what, row - len(values), float(here[axis]), float(allowed[axis]))

    # --- logged derivatives -------------------------------------------------------------------------------------

    def _logged(self, piece: Piece, position: Array, size: Array, commanded: Mask, stopping: Mask) -> None:
        """They keep the limits, and are those of the logged positions.

        The mean of two velocities is the mean velocity between them but for T^2/12 of the greatest jerk (trapezoidal
        rule); the mean of two accelerations that of the acceleration but for T/4 of it, as jerk may step in between.
        """
        below = position
        after, before = slice(1, None), slice(None, -1)
        both = rows_of(commanded, after) & rows_of(commanded, before)
        slow = rows_of(stopping, after) | rows_of(stopping, before)
        for row, name in enumerate(QUANTITIES):
            rates = piece.column(name)
            values = np.abs(rates)
            limits = LOGGED * self.limits[row], LOGGED * self.stop_limits[row]
            self._over(piece, values, (commanded, stopping), limits, f"logged {name}")
            if row < 2:
                share = BETWEEN * (self._period**2 / 12 if row == 0 else self._period / 4)
                rounding = 2 * ROUNDING * EPSILON * size / self._period
                rounding += CUT[row] * self.stop_limits[row]
                rounding += CUT[row - 1] * self.stop_limits[row - 1] / self._period if row else 0.0
                away = below[1:] - below[:-1]
                away /= self._period
                mean = rates[1:] + rates[:-1]
                mean *= 0.5
                away -= mean
                slack = self.limits[2] * share + rounding, self.stop_limits[2] * share + rounding
                self._over(piece, np.abs(away, out=away), (both, slow), slack, f"error of the logged {name}")
                size = np.maximum(peaks(values), 1.0)
            below = rates

    def _over(
        self, piece: Piece, values: Array, masks: tuple[Mask, Mask], allowed: tuple[Array, Array], what: str
    ) -> None:
        """Notes the worst of each axis that is over what is allowed: while moving, and while slowing.

        `masks`: values that are judged, and of those while slowing.
        """
        (judged, slow), (moving, stopping) = masks, allowed
        for axis in np.flatnonzero(~(peaks(values, judged) <= moving)):
            bound = np.where(slow[..., axis], stopping[axis], moving[axis])
            here = values[:, axis] * judged[..., axis]
            over = here - bound
            row = int(over.argmax())
            if not over[row] <= 0.0:
                worst = float(bound[row] if bound.ndim else bound)
                self._note(piece, int(axis), what, row - len(values), float(here[row]), worst)

    # --- rest and hard limits -----------------------------------------------------------------------------------

    def _rest(self, piece: Piece, position: Array, state: NDArray[np.uint32]) -> None:
        """A group that stands, or is held, keeps its setpoint to the bit."""
        still = in_states(state, AT_REST) & (piece.column("path_rate") == 0.0)
        stays = thin(still[1:] & still[:-1])[..., self._group]
        if stays.any():
            nothing = np.zeros(position.shape[1])
            moved = np.abs(position[1:] - position[:-1])
            self._over(piece, moved, (stays, stays), (nothing, nothing), "step of the setpoint at rest")

    def _hard_limits(self, piece: Piece, position: Array, commanded: Mask) -> None:
        low, high = self._hard
        for bound, beyond in ((high, position - high), (low, low - position)):
            for axis in np.flatnonzero(peaks(beyond, commanded) > 0.0):
                row = int((beyond[:, axis] * commanded[..., axis]).argmax()) - len(beyond)
                value = float(position[row, axis])
                self._note(piece, int(axis), "setpoint beyond the hard limit", row, value, float(bound[axis]))

    def _note(self, piece: Piece, axis: int, what: str, row: int, value: float, allowed: float) -> None:
        before = self._worst.get((axis, what))
        if before is not None and not abs(value) > abs(before.value):
            return
        row %= piece.carried + piece.new  # those of differences count from the end
        tick, log_time = int(piece.column("tick")[row]), int(piece.column("log_time")[row])
        self._worst[axis, what] = Excess(axis, what, tick, log_time, value, allowed)
