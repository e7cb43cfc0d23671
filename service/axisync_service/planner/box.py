"""What drives do alone: admission's box around every point of the path.

When SYNC stops, a drive runs on for up to N+2 periods at its velocity, then ramps down at its quick-stop deceleration.
So from every point q the axis can get anywhere within q +- (|v| (N+2) T + v^2 / 2a), which must lie within hard limits.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Axis

Array = NDArray[np.float64]

SAMPLES_PER_SEGMENT = 32
AFTER_LAST_SYNC = 2
"""Cycles after the last tolerated missing SYNC by which the ramp has begun."""


@dataclass(frozen=True, slots=True)
class Breach:
    """An axis that could leave its hard limits without the controller, and where on the path."""

    axis: str
    time_s: float
    required: float
    allowed: float

    @property
    def message(self) -> str:
        """For the user, in degrees."""
        return (
            f"{self.axis}: at {self.time_s:.3f} s of the move a drive left alone could run to "
            f"{math.degrees(self.required):.6g} deg, beyond its hard limit {math.degrees(self.allowed):.6g} deg"
        )


def breach(trajectory: Trajectory, axes: tuple[Axis, ...], period_s: float, missed_ticks_max: int) -> Breach | None:
    """The worst breach of hard limits, or None.

    The reach is sampled; between samples h apart it exceeds them by no more than h^2/8 of its second derivative.
    """
    times, step = _times(trajectory.knots)
    q, v, a, j = trajectory.sample(times)
    coast = (missed_ticks_max + AFTER_LAST_SYNC) * period_s
    ramp = np.array([axis.drive.quick_stop_deceleration for axis in axes])
    reach = np.abs(v) * coast + v * v / (2.0 * ramp)
    bend = np.abs(a) + np.abs(j) * coast + (a * a + np.abs(v * j)) / ramp
    reach += bend * (step * step / 8.0)[:, np.newaxis]
    low, high = np.array([axis.hard_limits for axis in axes]).T
    return _worst(q + reach, high, 1.0, times, axes) or _worst(q - reach, low, -1.0, times, axes)


def _times(knots: Array) -> tuple[Array, Array]:
    """Samples of every segment [k], and how far apart they are there [k]."""
    lengths = np.diff(knots)
    steps = np.repeat(lengths / SAMPLES_PER_SEGMENT, SAMPLES_PER_SEGMENT)
    begins = np.repeat(knots[:-1], SAMPLES_PER_SEGMENT)
    times = begins + steps * np.tile(np.arange(SAMPLES_PER_SEGMENT), len(lengths))
    return np.append(times, knots[-1]), np.append(steps, 0.0)


def _worst(extent: Array, bound: Array, sign: float, times: Array, axes: tuple[Axis, ...]) -> Breach | None:
    excess = sign * (extent - bound)
    row, column = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[row, column] <= 0.0:
        return None
    return Breach(axes[column].name, float(times[row]), float(extent[row, column]), float(bound[column]))
