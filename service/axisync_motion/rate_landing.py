"""The last ticks of a change of rate: to rest at the wanted rate, both exactly, in a whole number of ticks."""

from math import ceil
from typing import NamedTuple

TICKS = 10
"""A landing is sought from this many ticks before on."""
TRIES = 3


class Landing(NamedTuple):
    """u over n ticks: first, first + step, ..."""

    first: float
    step: float

    def last(self, n: int) -> float:
        return self.first + (n - 1) * self.step


def landing(excess: float, w: float, n: int, dt: float) -> Landing:
    """Takes both `excess`, the rate less the one wanted, and its derivative w to 0 in n ticks: two linear equations.

    With n = 1 only w.
    """
    drop, area = -w / dt, -(excess / dt + n * w) / dt  # sums of u[k], and of u[k] (n - k - 1/2)
    if n == 1:
        return Landing(drop, 0.0)
    moment = n * (n - 1) / 2.0
    determinant = n * n * (n * n - 1) / 12.0
    first = (area * moment - drop * (moment * (n - 0.5) / 3.0)) / determinant
    return Landing(first, (drop * (n * n / 2.0) - area * n) / determinant)


def ticks_to_land(excess: float, w: float, low: float, high: float, dt: float) -> int | None:
    """In how many ticks to land from here, with u in [low, high] and without passing the wanted rate; None: not yet."""
    if excess * w >= 0.0:
        return None
    exact = -2.0 * excess / (w * dt)  # with constant u
    if exact > TICKS:
        return None
    fewest = max(2, ceil(exact))
    for n in range(fewest, fewest + TRIES):
        curve = landing(excess, w, n, dt)
        last = curve.last(n)
        if last * w <= 0.0 and low <= min(curve.first, last) and max(curve.first, last) <= high:
            return n
    return None
