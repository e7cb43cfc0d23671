"""Chooses the second derivative u of a path clock's rate for one tick.

Towards what is wanted, as large as each axis allows from the tick's begin to its end, and no larger than can be made
good further along the path, which the tables of rate_tables.py know.
"""

from math import sqrt
from typing import NamedTuple

from .rate_interval import Derivatives, Interval, moment, nearest, of_acceleration, of_jerk
from .rate_landing import landing, ticks_to_land
from .rate_tables import STEEPEST, UNIT, RateTables, Table
from .trajectory import Evaluator, Trajectory

BRAKE = 0.85
"""Of what could be braked with now: what is counted on where the rate is to become neither 0 nor 1."""
LAND = 0.97
"""Of what is allowed when a landing begins: what it may ask for."""
TICKS_PER_CHANGE = 8
"""In how many ticks the rate changes from 0 to 1 at the quickest: in fewer, the tick would be too coarse."""
PASSES = 4
PREDICTION = 1e-9
"""s: how well the end of a tick must be known before the limits are evaluated there."""
BEYOND = 0.01
"""Of a tick: knots so near behind its end are looked at, too."""
KNOTS_MAX = 8
"""In one tick; a bound of its cost."""
LEFT = 1.0 - 2.0**-52
STRICTLY = 1.0 - 1e-5
"""Of the stop limits: the rest is for what lies between the moments of a tick that are looked at."""
TOO_FAST, TOO_FAST_1_S = 1.05, 0.003
"""Above a table by this factor and 1/s, the rate changes faster than can be made good within the limits of moves."""


class State(NamedTuple):
    """Path parameter, rate, and the rate's first two derivatives by time, the second of the tick that ends."""

    s: float
    rate: float
    rate1: float
    rate2: float


class Aim(NamedTuple):
    """What is wanted.

    Attributes:
        rate: to rest at.
        slowing: within the stop limits, to rate 0.
        catching: within the stop limits, to any rate that does not change.
        landing: ticks that are left of a landing; 0 before one has begun.
    """

    rate: float
    slowing: bool
    catching: bool
    landing: int


class Choice(NamedTuple):
    """What the tick is to bring.

    Attributes:
        u: second derivative of the rate, 1/s^2.
        landing: ticks then left of a landing, 0: the rate wanted is reached; None: there is none.
        caught: the rate does not change any more.
        relaxed: within the stop limits only.
    """

    u: float
    landing: int | None = None
    caught: bool = False
    relaxed: bool = False


class Chooser:
    """For one trajectory and period. Remembers nothing but how far along the path it is."""

    def __init__(self, trajectory: Trajectory, tables: RateTables, period: float) -> None:
        self._dt = period
        self._ahead = Evaluator(trajectory)
        self._knots: list[float] = trajectory.knots.tolist()
        self._knot = 1
        most = [min(steepest, 2.0 / (TICKS_PER_CHANGE * period)) for steepest in STEEPEST[:, 0].tolist()]
        self._stop, self._fall, self._rise = (
            Table(codes, unit, trajectory.duration, steepest)
            for codes, unit, steepest in zip(tables.codes, UNIT[:, 0].tolist(), most, strict=True)
        )
        a, j = tables.limits[:2].tolist()
        a_stop, j_stop = (STRICTLY * tables.limits[2:]).tolist()
        self._moves = a, j, most[1] ** 2
        self._stops = a_stop, j_stop, most[0] ** 2

    def choose(self, now: State, here: Derivatives, aim: Aim) -> Choice:
        """For the tick that begins at `now`, where the path has the derivatives `here`."""
        choice = Choice(now.rate2)
        for _ in range(PASSES):
            guess = choice.u
            choice = self._choose(now, here, aim, guess)
            if abs(choice.u - guess) * self._dt**3 <= 6.0 * PREDICTION:
                break
        return choice

    def _choose(self, now: State, here: Derivatives, aim: Aim, guess: float) -> Choice:
        """Given about what it will be."""
        if aim.slowing or aim.catching:
            allowed, _ = self._allowed(now, here, guess, self._stops)
            return self._caught(now, allowed, True) if aim.catching else self._towards(now, aim, guess, allowed)
        allowed, possible = self._allowed(now, here, guess, self._moves)
        if possible and not self._too_fast(now):
            return self._towards(now, aim, guess, allowed)
        caught = self._caught(now, allowed)
        if possible and caught.u * now.rate1 < 0.0 and now.rate < 1.0:
            return caught
        return self._choose(now, here, aim._replace(catching=True, landing=0), guess)

    def _caught(self, now: State, allowed: Interval, relaxed: bool = False) -> Choice:
        """Nearest to a rate that does not change: there all limits hold, wherever on the path."""
        needed = -now.rate1 / self._dt
        u = min(max(needed, allowed[0]), allowed[1])
        return Choice(u, caught=u == needed, relaxed=relaxed)

    def _too_fast(self, now: State) -> bool:
        """No table lets the rate change so: it would pass 1, or leave the limits further on."""
        s, rate, w, _ = now
        if w > 0.0:
            return rate >= 1.0 or w > TOO_FAST * self._rise.at(s, min(max(1.0 - rate, 0.0), 1.0)) + TOO_FAST_1_S
        return -w > TOO_FAST * self._fall.at(s, min(rate, 1.0)) + TOO_FAST_1_S

    # --- what the axes allow ------------------------------------------------------------------------------------

    def _allowed(
        self, now: State, here: Derivatives, guess: float, limits: tuple[list[float], list[float], float]
    ) -> tuple[Interval, bool]:
        """u that keeps the limits from the tick's begin to its end; False with the least wrong if none does."""
        s, r, w, _ = now
        dt = self._dt
        a, j, bend = limits
        end = self._end(now, guess)
        allowed = of_jerk(here, moment(r, w, guess, 0.0), j, (-bend, bend))
        for knot in self._knots_between(s, end):
            tau = dt * min((knot - s) / (end - s), 1.0)
            for side in (knot * LEFT, knot):
                allowed = of_jerk(self._ahead.at(side), moment(r, w, guess, tau), j, allowed)
        there, last = self._ahead.at(end), moment(r, w, guess, dt)
        allowed = of_jerk(there, last, j, allowed)
        if allowed[0] > allowed[1]:
            middle = 0.5 * (allowed[0] + allowed[1])
            return (middle, middle), False
        wanted = of_acceleration(there, last, a)
        possible = max(allowed[0], wanted[0]) <= min(allowed[1], wanted[1])
        return nearest(allowed, wanted), possible

    def _end(self, now: State, u: float) -> float:
        dt = self._dt
        return max(now.s, now.s + dt * (now.rate + dt * (now.rate1 / 2.0 + dt * u / 6.0)))

    def _knots_between(self, s: float, end: float) -> list[float]:
        knots = self._knots
        while self._knot < len(knots) - 1 and knots[self._knot] <= s:
            self._knot += 1
        near = end + BEYOND * (end - s)
        return [knot for knot in knots[self._knot : self._knot + KNOTS_MAX] if s < knot <= near]

    # --- where to -----------------------------------------------------------------------------------------------

    def _towards(self, now: State, aim: Aim, guess: float, allowed: Interval) -> Choice:
        choice = self._land(now, aim, allowed)
        if choice is not None:
            return choice
        r, w, dt = now.rate, now.rate1, self._dt
        end, u = self._end(now, guess), guess
        for _ in range(2):
            wanted = (self._slope(end, r + dt * (w + dt * u / 2.0), aim, allowed) - w) / dt
            u = min(max(wanted, allowed[0]), allowed[1])
        return Choice(u if aim.slowing else self._within_tables(end, now, u, allowed))

    def _within_tables(self, end: float, now: State, wanted: float, allowed: Interval) -> float:
        """u as near to `wanted` as the tables allow at the rate that u itself leads to.

        They are steep near rate 1, and a large u would find itself allowed: so it is looked for from u = 0 on.
        """
        r, w, dt = now.rate, now.rate1, self._dt
        u = 0.0
        for _ in range(2):
            after = min(max(r + dt * (w + dt * u / 2.0), 0.0), 1.0)
            low, high = nearest(
                allowed, ((-self._fall.at(end, after) - w) / dt, (self._rise.at(end, 1.0 - after) - w) / dt)
            )
            u = min(max(wanted, low), high)
        return u

    def _land(self, now: State, aim: Aim, allowed: Interval) -> Choice | None:
        excess, w, dt = now.rate - aim.rate, now.rate1, self._dt
        n = aim.landing or ticks_to_land(excess, w, LAND * allowed[0], LAND * allowed[1], dt)
        if not n:
            return None
        u = landing(excess, w, n, dt).first
        return Choice(u, n - 1) if allowed[0] <= u <= allowed[1] else None

    def _slope(self, s: float, rate: float, aim: Aim, allowed: Interval) -> float:
        """How fast the rate is to change at s, if it is `rate`."""
        rate = min(max(rate, 0.0), 1.0)
        way = abs(rate - aim.rate)
        if way == 0.0:
            return 0.0
        if rate > aim.rate:
            return -self._discrete(self._falling(s, rate, way, aim, allowed), way)
        if aim.rate == 1.0:
            return self._discrete(self._rise.at(s, way), way)
        return self._discrete(sqrt(2.0 * BRAKE * way * max(-allowed[0], 0.0)), way)

    def _falling(self, s: float, rate: float, way: float, aim: Aim, allowed: Interval) -> float:
        if aim.rate == 0.0:
            return (self._stop if aim.slowing else self._fall).at(s, rate)
        return sqrt(2.0 * BRAKE * way * max(allowed[1], 0.0))

    def _discrete(self, slope: float, way: float) -> float:
        """A tick less steep than the curve that comes to rest after `way`, so that a landing finds room."""
        step = 0.5 * slope * slope / way * self._dt
        return sqrt(slope * slope + step * step) - step
