"""What drives do alone: admission's box around every point of the path.

When SYNC stops, a drive runs on for up to N+2 periods at its velocity, then ramps down at its quick-stop deceleration.
So from every point q the axis can get anywhere within q +- (|v| (N+2) T + v^2 / 2a), which must lie within hard limits.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Axis, Cell

Array = NDArray[np.float64]

SAMPLES_PER_SEGMENT = 32
SAMPLES_MAX_S = 0.01
AFTER_LAST_SYNC = 2
"""Cycles after the last tolerated missing SYNC by which the ramp has begun."""


@dataclass(frozen=True, slots=True)
class Room:
    """What is left to a hard limit where a drive left alone would come nearest it; negative: it is left."""

    axis: str
    margin: float
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


def reach_of(v: Array, a: Array, cell: Cell, axes: tuple[int, ...]) -> Array:
    """[k, n] how far each axis may get from where it is at velocities v and accelerations a [k, n]."""
    coast = (cell.missed_ticks_max + AFTER_LAST_SYNC) * cell.period
    ramp = np.array([cell.axes[i].drive.quick_stop_deceleration for i in axes])
    speed = np.abs(v) + np.abs(a) * coast
    return speed * coast + speed * speed / (2.0 * ramp)


def room(trajectory: Trajectory, cell: Cell, axes: tuple[int, ...]) -> Room:
    """The least room that any axis has.

    The reach is sampled; between samples h apart it exceeds them by no more than h^2/8 of its second derivative.
    """
    times, step = _times(trajectory.knots)
    q, v, a, j = trajectory.sample(times)
    chosen = [cell.axes[i] for i in axes]
    coast = (cell.missed_ticks_max + AFTER_LAST_SYNC) * cell.period
    ramp = np.array([axis.drive.quick_stop_deceleration for axis in chosen])
    reach = np.abs(v) * coast + v * v / (2.0 * ramp)
    bend = np.abs(a) + np.abs(j) * coast + (a * a + np.abs(v * j)) / ramp
    reach += bend * (step * step / 8.0)[:, np.newaxis]
    low, high = np.array([axis.hard_limits for axis in chosen]).T
    return min(
        _least(high - (q + reach), q + reach, high, times, chosen),
        _least((q - reach) - low, q - reach, low, times, chosen),
        key=lambda found: found.margin,
    )


def _times(knots: Array) -> tuple[Array, Array]:
    """Samples of every segment [k], and how far apart they are there [k]; no finer than a hundred a second needs."""
    lengths = np.diff(knots)
    counts = np.clip(np.ceil(lengths / SAMPLES_MAX_S), 4, SAMPLES_PER_SEGMENT).astype(np.intp)
    steps = np.repeat(lengths / counts, counts)
    begins = np.repeat(knots[:-1], counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(begins + steps * number, knots[-1]), np.append(steps, 0.0)


def _least(margin: Array, extent: Array, bound: Array, times: Array, axes: list[Axis]) -> Room:
    row, column = np.unravel_index(int(np.argmin(margin)), margin.shape)
    value = float(margin[row, column])
    return Room(axes[column].name, value, float(times[row]), float(extent[row, column]), float(bound[column]))
