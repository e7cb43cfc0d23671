"""One plan played again by the controller's own `Motion`, tick by tick."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_review.effects import Effects, apply
from axisync_schemas.cell import Cell
from axisync_schemas.log_models import PlanLog
from axisync_service.motion_controller.plan_file import slot_plan
from axisync_service.motion_controller.player import Motion

Array = NDArray[np.float64]

CATCH_UP_MAX = 3_600_000
"""Ticks of a plan that began before the log: two hours."""


class NotReplayable(Exception):
    """Why a plan's setpoints cannot be computed again; the end of a sentence that begins with the plan."""


@dataclass(slots=True)
class Playing:
    """A motion under way, at the setpoint of tick `tick`."""

    motion: Motion
    effects: Effects
    tick: int

    def advance(self) -> tuple[Array, ...] | None:
        """One tick on: position, velocity, acceleration, jerk [axes of the plan]; None while it is held."""
        apply(self.motion, self.effects, self.tick)
        self.tick += 1
        return None if self.motion.at_rest else self.motion.advance()

    @property
    def over(self) -> bool:
        """The move was over before the setpoint of `tick`, as the log says."""
        return self.effects.ended is not None and self.effects.ended < self.tick


@dataclass(frozen=True, slots=True)
class Met:
    """Where a plan is met first in the ticks: its tick, path parameter and rate there."""

    tick: int
    path_s: float
    rate: float


def begin(cell: Cell, plan: PlanLog | None, effects: Effects, met: Met) -> Playing:
    """The plan just before the tick in which it is met.

    Raises:
        NotReplayable: it is not in the log, or what happened to it before is not.
    """
    if plan is None or not plan.knots:
        raise NotReplayable("is not in the log")
    started = effects.started if effects.started is not None else _started(cell, met)
    try:
        motion = Motion(slot_plan(plan), 0, plan.group, cell.members(plan.group), cell.period)
    except (ValueError, KeyError, IndexError) as fault:
        raise NotReplayable(f"cannot be read ({fault})") from None
    playing = Playing(motion, effects, started)
    while playing.tick < met.tick - 1:
        playing.advance()
    return playing


def path_of(plan: PlanLog) -> Trajectory:
    """The path of a logged plan that has its polynomials."""
    return Trajectory(np.array(plan.knots), np.array(plan.coefficients), np.array(plan.start), np.array(plan.end))


def _started(cell: Cell, met: Met) -> int:
    """A move that was never slowed shows by its path parameter how many ticks it has run."""
    ran = round(met.path_s / cell.period)
    if met.rate != 1.0 or ran * cell.period != met.path_s or not 0 < ran < CATCH_UP_MAX:
        raise NotReplayable("began before the log, and was slowed since")
    return met.tick - ran
