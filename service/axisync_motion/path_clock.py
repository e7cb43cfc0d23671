"""Time along a path: its rate between 0 and 1, changed by override, hold, resume and stop within every axis's limits.

With q(s) the path and r = ds/dt its rate: v = q' r, a = q'' r^2 + q' r', j = q''' r^3 + 3 q'' r r' + q' r''. In every
tick r'' is constant.
"""

from math import isfinite

from .closed_forms import Array
from .rate_choice import Aim, Chooser, State
from .rate_interval import Derivatives
from .rate_tables import RateTables
from .trajectory import Evaluator, Trajectory


def derivatives(q1: Array, q2: Array, q3: Array, rate: float, rate1: float, rate2: float) -> tuple[Array, Array, Array]:
    """Velocity, acceleration, jerk [n] by time from the derivatives by s and the rate with its first two by time."""
    v = q1 * rate
    a = q2 * (rate * rate) + q1 * rate1
    j = q3 * (rate * rate * rate) + q2 * (3.0 * rate * rate1) + q1 * rate2
    return v, a, j


class PathClock:
    """Plays a trajectory, tick by tick.

    Commands act from the next tick on and may come at any time. While the rate does not change, s is the product of
    its ticks with their length; the same ticks and commands give the same bits.

    Attributes:
        s: path parameter at the present tick; grows, never falls.
        rate: ds/dt, 0 to 1; rate1 and rate2 are its derivatives by time, rate2 that of the tick that ends now.
        override: the rate to run at, 0 to 1.
        holding, stopping: a hold or a stop has begun; a stop is for good.
        relaxed: the tick that ends now kept the stop limits, not those of moves.
    """

    def __init__(self, trajectory: Trajectory, tables: RateTables, period: float, s: float = 0.0) -> None:
        """At s, at rate 1; `tables` must be those of this trajectory, `period` is the tick's length."""
        self.s, self.rate, self.rate1, self.rate2 = s, 1.0, 0.0, 0.0
        self.override = 1.0
        self.holding = self.stopping = self.relaxed = False
        self._duration = trajectory.duration
        self._period = period
        self._catching = False  # after a resume, until the rate no longer falls
        self._landing = 0  # ticks left
        self._base, self._ticks = s, 0  # s where the present rate began, and ticks since
        self._evaluator = Evaluator(trajectory)
        self._chooser = Chooser(trajectory, tables, period)
        self._here: Derivatives = self._evaluator.at(s)

    @property
    def slowing(self) -> bool:
        """On the way to rest, or at rest, until resumed."""
        return self.holding or self.stopping

    @property
    def arrived(self) -> bool:
        """At the end of the path."""
        return self.s >= self._duration

    @property
    def at_rest(self) -> bool:
        """Arrived, held or stopped, and still. (With an override of 0 the rate rests, the motion does not.)"""
        return self.arrived or (self.slowing and self.rate == 0.0 and self.rate1 == 0.0)

    def stop(self) -> None:
        """Come to rest on the path as soon as the stop limits allow, for good."""
        self._slow()
        self.stopping = True

    def hold(self) -> None:
        """Come to rest as `stop` does, until resumed."""
        self._slow()
        self.holding = True

    def resume(self) -> None:
        """Go on, from rest or while still slowing. After `stop` nothing goes on."""
        if self.holding and not self.stopping:
            self.holding, self._catching, self._landing = False, self.rate1 < 0.0, 0

    def set_override(self, rate: float) -> None:
        """Run at another rate, reached within the limits of moves.

        Raises ValueError unless 0 <= rate <= 1.
        """
        if not (isfinite(rate) and 0.0 <= rate <= 1.0):
            raise ValueError(f"override = {rate!r}: must be 0 to 1")
        if rate != self.override:
            self.override = float(rate)
            if not self.slowing:
                self._landing = 0

    def advance(self) -> None:
        """One tick on."""
        wanted = 0.0 if self.slowing else self.override
        if self.rate1 == 0.0 and self.rate == wanted:
            self.rate2, self.relaxed, self._catching = 0.0, False, False
            self._ticks += 1
            self.s = self._base + self._ticks * (self._period * self.rate)
        else:
            self._change(wanted)
        self._here = self._evaluator.at(self.s)

    def motion(self) -> Derivatives:
        """Position, velocity, acceleration, jerk [n], in buffers that the next tick may overwrite."""
        q, q1, q2, q3 = self._here
        if self.rate == 1.0 and self.rate1 == 0.0 and self.rate2 == 0.0:
            return self._here
        return (q, *derivatives(q1, q2, q3, self.rate, self.rate1, self.rate2))

    def _slow(self) -> None:
        if not self.slowing:
            self._catching, self._landing = False, 0

    def _change(self, wanted: float) -> None:
        dt, r, w = self._period, self.rate, self.rate1
        aim = Aim(wanted, self.slowing, self._catching, self._landing)
        choice = self._chooser.choose(State(self.s, r, w, self.rate2), self._here, aim)
        u = choice.u
        self.s = max(self.s, self.s + dt * (r + dt * (w / 2.0 + dt * u / 6.0)))
        self.rate, self.rate1, self.rate2 = max(r + dt * (w + dt * u / 2.0), 0.0), w + dt * u, u
        if choice.landing == 0:
            self.rate, self.rate1 = wanted, 0.0
        elif choice.caught:
            self.rate1, self._catching = 0.0, False
        if self.rate == 0.0:
            self.rate1 = max(self.rate1, 0.0)
        self.relaxed = self.slowing or choice.relaxed
        self._landing = choice.landing or 0
        self._base, self._ticks = self.s, 0
