"""Plays one plan: the path clock runs over it; whatever changes a move's speed changes the clock's rate."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from axisync_motion.path_clock import PathClock
from axisync_motion.rate_tables import RateTables
from axisync_motion.trajectory import Trajectory
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
        axes: indices of their axes, as in the plan: [n], or a slice where they follow each other.
        ending: SUCCEEDED until something slows it.
        relaxed_ticks: ticks not on the way to rest in which the stop limits were kept only, not those of moves.
        jog_until_ns: of a jog, when it stops unless it is told to go on; None for a move.
        share: of the velocity that a jog was planned with, 0..1.
    """

    def __init__(
        self, plan: Plan, slot: int, group: str, members: tuple[int, ...], period_s: float,
        jog_until_ns: int | None = None,
    ) -> None:  # fmt: skip
        self.plan_id, self.slot, self.group, self.members = plan.plan_id, slot, group, members
        self.axes = _columns(plan.axes.tolist())
        self.ending = Ending.SUCCEEDED
        self.reason: str | None = None
        self.relaxed_ticks = 0
        self.jog_until_ns = jog_until_ns
        self.share = 1.0
        self._duration = plan.duration
        trajectory = Trajectory(plan.knots, plan.coefficients, plan.start, plan.end)
        self._clock = PathClock(trajectory, RateTables(plan.rate_codes, plan.rate_limits), period_s)

    @property
    def kind(self) -> str:
        """A word for it."""
        return "move" if self.jog_until_ns is None else "jog"

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
        return self._clock.arrived

    @property
    def at_rest(self) -> bool:
        """Arrived, held or stopped on the path."""
        return self._clock.at_rest

    @property
    def slowing(self) -> bool:
        """A stop or a hold has begun."""
        return self._clock.slowing

    @property
    def resumable(self) -> bool:
        """Held, or on the way to be."""
        return self.ending is Ending.HELD

    def slow(self, ending: Ending, reason: str) -> bool:
        """Comes to rest on the path within the stop limits; True if this is news."""
        news = ending > self.ending
        if news:
            self.ending, self.reason = ending, reason
        if ending is Ending.HELD:
            self._clock.hold()
        else:
            self._clock.stop()
        return news

    def resume(self) -> None:
        """Goes on after a hold; after a stop nothing does."""
        if self.resumable:
            self.ending, self.reason = Ending.SUCCEEDED, None
            self._clock.resume()

    def set_override(self, rate: float) -> None:
        """The rate to run at, 0..1."""
        self._clock.set_override(rate)

    def advance(self) -> tuple[Array, Array, Array, Array]:
        """One tick on: position, velocity, acceleration, jerk [n], in buffers that the next call may overwrite."""
        self._clock.advance()
        self.relaxed_ticks += self._clock.relaxed and not self._clock.slowing
        q, v, a, j = self._clock.motion()
        return (q, v, a, np.zeros_like(j)) if self.at_rest else (q, v, a, j)  # the last tick's jerk is over


def _columns(axes: list[int]) -> "slice | NDArray[np.intp]":
    """As numpy takes them fastest."""
    first, end = axes[0], axes[0] + len(axes)
    return slice(first, end) if axes == list(range(first, end)) else np.array(axes, dtype=np.intp)
