"""The curves that T and U of a plan stand for, sampled for drawing."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from axisync_cli.scalars import Scalar, units
from axisync_schemas.replies import MoveReply

Array = NDArray[np.float64]
PulseName = Literal["constant", "parabolic"]

POINTS = 21
"""Of each segment, its ends among them: where the jerk steps, both of its values are sampled."""
PULSES = {"constant": Polynomial([1.0]), "parabolic": Polynomial([0.0, 4.0, -4.0])}
"""Jerk over its peak, by the part x of the segment that has passed."""


class Curves(NamedTuple):
    """Of each row: its name, times [k], s, and values [4, k]: position, velocity, acceleration, jerk.

    `unit` is that of the positions, or several with commas; the others are per s, s^2 and s^3.
    """

    names: tuple[str, ...]
    times: tuple[Array, ...]
    values: tuple[Array, ...]
    unit: str

    @property
    def duration(self) -> float:
        """Of the longest curve, s."""
        return max((float(times[-1]) for times in self.times), default=0.0)


def curves(reply: MoveReply, scalars: tuple[Scalar, ...], pulse: PulseName) -> Curves:
    """Of every row of a plan, in the unit that it is shown in."""
    times, values = [], []
    for scalar, series, jerks in zip(scalars, reply.T, reply.U, strict=True):
        at, states = sampled(series, jerks, pulse)
        states[0] += scalar.start
        times.append(at)
        values.append(states * scalar.shown(1.0))
    return Curves(tuple(scalar.label for scalar in scalars), tuple(times), tuple(values), ", ".join(units(scalars)))


def sampled(series: Sequence[float], jerks: Sequence[float], pulse: PulseName) -> tuple[Array, Array]:
    """Times [k] and states [4, k] of one axis from rest at 0 to rest: of segment times (s) and peak jerks [7]."""
    x = np.linspace(0.0, 1.0, POINTS)
    jerk, *integrals = (PULSES[pulse].integ(order)(x) for order in range(4))
    begin, state = 0.0, np.zeros(3)
    times, states = [np.zeros(1)], [np.zeros((4, 1))]
    for h, peak in zip(series, jerks, strict=True):
        if h > 0.0:
            s, v, a = state
            t = h * x
            acceleration = a + peak * h * integrals[0]
            velocity = v + a * t + peak * h**2 * integrals[1]
            position = s + (v + a * t / 2.0) * t + peak * h**3 * integrals[2]
            times.append(begin + t)
            states.append(np.array([position, velocity, acceleration, peak * jerk]))
            begin, state = begin + h, states[-1][:3, -1]
    times.append(np.array([begin]))
    states.append(np.array([[state[0]], [0.0], [0.0], [0.0]]))
    return np.concatenate(times), np.concatenate(states, axis=1)
