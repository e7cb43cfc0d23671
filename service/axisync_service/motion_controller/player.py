"""Plays one plan: the path clock runs over it, and everything that slows a move is the same stop on the path."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from axisync_motion.path_clock import PathClock, derivatives
from axisync_motion.stop_table import StopTable
from axisync_motion.trajectory import Evaluator, Trajectory
from axisync_schemas.plan_slots import Plan

Array = NDArray[np.float64]


class Ending(IntEnum):
    """What a motion is to become when it rests; a graver one replaces a lighter one."""

    SUCCEEDED = 0
    HELD = 1
    STOPPED = 2
    FAILED = 3


class Motion:
    """A plan being played by one or more groups under one path clock.

    Attributes:
        members: indices of the elementary groups that move.
        axes: [n] indices of their axes, as in the plan.
        ending: SUCCEEDED until something slows it.
    """

    def __init__(self, plan: Plan, slot: int, group: str, members: tuple[int, ...], period_s: float) -> None:
        self.plan_id, self.slot, self.group, self.members = plan.plan_id, slot, group, members
        self.axes = plan.axes.astype(np.intp)
        self.ending = Ending.SUCCEEDED
        self.reason: str | None = None
        self._duration = plan.duration
        self._evaluator = Evaluator(Trajectory(plan.knots, plan.coefficients, plan.start, plan.end))
        self._stops = StopTable(plan.stop_s, plan.stop_duration)
        self._clock = PathClock()
        self._period = period_s

    @property
    def path_s(self) -> float:
        """Path parameter, s."""
        return min(self._clock.s, self._duration)

    @property
    def rate(self) -> float:
        """Rate of the path clock."""
        return self._clock.rate

    @property
    def arrived(self) -> bool:
        """At the end of the path."""
        return self._clock.s >= self._duration

    @property
    def at_rest(self) -> bool:
        """Arrived, or stopped on the path."""
        return self.arrived or self._clock.at_rest

    @property
    def slowing(self) -> bool:
        """A stop has begun."""
        return self._clock.stopping

    def slow(self, ending: Ending, reason: str) -> bool:
        """Stops on the path within the stop limits; True if this is news. A stop that runs is never made slower."""
        news = ending > self.ending
        if news:
            self.ending, self.reason = ending, reason
        if not self._clock.stopping:
            self._clock.stop(self._stops.at(self._clock.s))
        return news

    def advance(self) -> tuple[Array, Array, Array, Array]:
        """One tick on: position, velocity, acceleration, jerk [n], in buffers that the next call may overwrite."""
        self._clock.advance(self._period)
        clock = self._clock
        q, q1, q2, q3 = self._evaluator.at(clock.s)
        if clock.rate == 1.0:
            return q, q1, q2, q3
        return (q, *derivatives(q1, q2, q3, clock.rate, clock.rate1, clock.rate2))
