"""Which second derivative u of a path clock's rate the axes allow over a tick, throughout which it is constant.

At time tau into the tick the rate r and its first derivative w have become r + w tau + u tau^2/2 and w + u tau. Put
into a = q'' r^2 + q' w and j = q''' r^3 + 3 q'' r w + q' u, these are linear in u but for terms of tau^3. They are
taken as linear about a guess of u, so that each axis allows an interval, exact where the guess is right.
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from .closed_forms import Array

SMALL = 1e-14
"""Of a limit: an axis whose jerk or acceleration changes by less with u, per 1/s^3, has no say."""

Interval = tuple[float, float]
Derivatives = tuple[Array, Array, Array, Array]
"""Position and its first three derivatives by s, [n]."""

ALL: Interval = (-inf, inf)


class Moment(NamedTuple):
    """Time into the tick, and the rate and its first two derivatives there, with the guess for the second."""

    tau: float
    rate: float
    rate1: float
    rate2: float


def moment(rate: float, rate1: float, guess: float, tau: float) -> Moment:
    """`tau` after `rate` and `rate1`."""
    return Moment(tau, rate + tau * (rate1 + tau * guess / 2.0), rate1 + tau * guess, guess)


def of_jerk(q: Derivatives, at: Moment, limits: Sequence[float], within: Interval = ALL) -> Interval:
    """The part of `within` that keeps |j| <= limits[n] at a moment at which the path has q."""
    tau, r, w, u = at
    third, second = r * r * r, 3.0 * r * w
    more2, more3 = 3.0 * tau * (r + 0.5 * w * tau), 1.5 * (r * tau) * (r * tau)
    low, high = within
    for q1, q2, q3, limit in zip(q[1].tolist(), q[2].tolist(), q[3].tolist(), limits, strict=True):
        gain = q1 + q2 * more2 + q3 * more3
        jerk = q3 * third + q2 * second + q1 * u
        if gain < 0.0:
            gain, jerk = -gain, -jerk
        if gain > SMALL * limit:
            least, most = u - (limit + jerk) / gain, u + (limit - jerk) / gain
            if least > low:
                low = least
            if most < high:
                high = most
    return low, high


def of_acceleration(q: Derivatives, at: Moment, limits: Sequence[float]) -> Interval:
    """The interval that keeps |a| <= limits[n] at a moment at which the path has q."""
    tau, r, w, u = at
    square, more = r * r, r * tau * tau
    low, high = ALL
    for q1, q2, limit in zip(q[1].tolist(), q[2].tolist(), limits, strict=True):
        gain = q1 * tau + q2 * more
        acceleration = q2 * square + q1 * w
        if gain < 0.0:
            gain, acceleration = -gain, -acceleration
        if gain > SMALL * limit:
            least, most = u - (limit + acceleration) / gain, u + (limit - acceleration) / gain
            if least > low:
                low = least
            if most < high:
                high = most
    return low, high


def nearest(within: Interval, wanted: Interval) -> Interval:
    """What of `wanted` is in `within`; if nothing is, the point of `within` that is nearest to it."""
    low, high = max(within[0], wanted[0]), min(within[1], wanted[1])
    if low <= high:
        return low, high
    point = 0.5 * (wanted[0] + wanted[1])
    point = min(max(point, within[0]), within[1])
    return point, point
