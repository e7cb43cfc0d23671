"""Distances along a planned motion: of the path itself, and of wherever drives could get to by themselves."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_robot.collision import RESOLUTION, Check, CollisionModel, Near
from axisync_schemas.cell import Cell
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.plan_slots import Plan
from axisync_service.planner.box import reach_of
from axisync_service.planner.leg import Contacts

Array = NDArray[np.float64]

CHORD = 2e-4
"""rad: between samples a joint is no farther from the straight line than this; distances take it off."""
FEWEST = 8


@dataclass(frozen=True, slots=True)
class Clearance:
    """The least distances (m; infinite where nothing is watched) of the path and of what drives do alone."""

    path: float = math.inf
    pair: tuple[str, str] | None = None
    alone: float = math.inf

    def worst(self, other: "Clearance") -> "Clearance":
        """Of two motions together."""
        near = min((self, other), key=lambda clearance: clearance.path)
        return Clearance(near.path, near.pair, min(self.alone, other.alone))


@dataclass(frozen=True, slots=True, eq=False)
class Sampled:
    """A motion as a polyline in joint space.

    Attributes:
        times: [k]; q: [k, n].
        chord: [n] how far off the polyline the motion may be; reach: [k, n] that, and how far drives get alone.
    """

    times: Array
    q: Array
    chord: Array
    reach: Array

    @classmethod
    def of(cls, trajectory: Trajectory, cell: Cell, axes: tuple[int, ...]) -> "Sampled":
        """Fine enough for `CHORD`."""
        middle = 0.5 * (trajectory.knots[1:] + trajectory.knots[:-1])
        bends = np.abs(trajectory.sample(np.concatenate((trajectory.knots, middle)))[2])
        bent = max(float(bends.max(initial=0.0)), 1e-9)
        count = max(FEWEST, math.ceil(trajectory.duration / math.sqrt(8.0 * CHORD / bent)) + 1)
        times = np.linspace(0.0, trajectory.duration, count)
        q, v, a, _ = trajectory.sample(times)
        chord = np.full(q.shape[1], CHORD)
        return cls(times, q, chord, reach_of(v, a, cell, axes) + chord)


class Guard:
    """Checks the motions of one job: with everything else of the cell at rest, and with other groups on their paths."""

    def __init__(self, cell: Cell, model: CollisionModel, group: str, rest: Array, margin: float | None = None) -> None:
        """`margin` (m): to keep along paths; the cell file's where it is None."""
        self._cell, self._model, self._group, self._rest = cell, model, group, rest
        self._axes = cell.axis_indices(group)
        self._margin = margin

    def check(self, trajectory: Trajectory, contacts: Contacts, others: tuple[Plan, ...]) -> Clearance:
        """
        Raises:
            Refusal: COLLISION; INVALID_REQUEST for contacts that the cell file does not have.
        """
        return self.check_samples(Sampled.of(trajectory, self._cell, self._axes), contacts, others)

    def check_samples(
        self, motion: Sampled, contacts: Contacts, others: tuple[Plan, ...], *, alone: bool = True
    ) -> Clearance:
        """As `check`, of a motion as samples; not of what its drives do `alone` where that is not asked for."""
        found = Clearance()
        try:
            # First, since where those groups are now is on their paths, and the fix is another.
            for other in others:
                found = found.worst(self._beside(motion, contacts, other))
            return found.worst(self._among_itself(motion, contacts, alone))
        except ValueError as error:
            fault = {"path": "move.contacts", "message": str(error)}
            raise Refusal(ErrorCode.INVALID_REQUEST, str(error), errors=[fault]) from None

    def _among_itself(self, motion: Sampled, contacts: Contacts, alone: bool) -> Clearance:
        widened = [(self._margin, motion.chord), (0.0, motion.reach)][: 1 + alone]
        found = self._model.check_widened(motion.q, widened, group=self._group, rest=self._rest, contacts=contacts)
        path, reached = found[0], found[1:]
        self._refuse(path, motion, alone=False)
        clearance = Clearance(path.min_distance, path.nearest.pair if path.nearest else None)
        for check in reached:
            self._refuse(check, motion, alone=True)
            clearance = replace(clearance, alone=check.min_distance)
        return clearance

    def _beside(self, motion: Sampled, contacts: Contacts, plan: Plan) -> Clearance:
        """Whole path against whole path, each with what its drives do alone: timing never counts."""
        axes = tuple(plan.axes.tolist())
        name = self._name(axes)
        other = Sampled.of(Trajectory(plan.knots, plan.coefficients, plan.start, plan.end), self._cell, axes)
        found = self._model.check_sweeps(
            {self._group: motion.q, name: other.q},
            self._margin,
            spreads={self._group: motion.reach, name: other.reach},
            contacts=contacts,
        )
        self._refuse(found, motion, alone=True, other=name)
        near = found.nearest
        return Clearance(found.min_distance, near.pair if near else None, found.min_distance)

    def _name(self, axes: tuple[int, ...]) -> str:
        names = [*self._cell.group_names, *(compound.name for compound in self._cell.compounds)]
        return next(name for name in names if self._cell.axis_indices(name) == axes)

    def _refuse(self, check: Check, motion: Sampled, *, alone: bool, other: str | None = None) -> None:
        near = check.violation
        if near is None:
            return
        place = near.places[0] if near.places else 0.0
        time = float(np.interp(place, np.arange(len(motion.times)), motion.times))
        joints = [float(np.interp(place, np.arange(len(motion.times)), column)) for column in motion.q.T]
        fix = {"fix": self._fix(other)} if other else {}
        raise Refusal(
            ErrorCode.COLLISION, _sentence(near, check.margin, time, alone, other), pair=list(near.pair),
            distance_m=near.distance, margin_m=check.margin, time_s=time, alone=alone, position=joints, **fix,
        )  # fmt: skip

    def _fix(self, other: str) -> dict[str, str]:
        """Under one clock the two can be where they never are together."""
        wanted = {*self._cell.members(self._group), *self._cell.members(other)}
        for compound in self._cell.compounds:
            if wanted <= set(self._cell.members(compound.name)):
                return {"group": compound.name}
        return {"wait_for": other}


def _sentence(near: Near, margin: float, time: float, alone: bool, other: str | None) -> str:
    pair = " and ".join(near.pair)
    if other is not None:
        return (
            f"{pair} could meet: {1e3 * max(near.distance, 0.0):.2f} mm between this path at {time:.3f} s and the one "
            f"that {other} is on; two groups with clocks of their own must not share space"
        )
    if alone:
        return f"{pair} could touch if the drives had to stop by themselves at {time:.3f} s of the move"
    if near.distance <= 0.0:
        return f"{pair} touch at {time:.3f} s of the move"
    distance, least = f"{1e3 * near.distance:.2f} mm", 1e3 * (margin + RESOLUTION)
    return f"{pair} come within {distance} at {time:.3f} s of the move; nearer than {least:g} mm is refused"
