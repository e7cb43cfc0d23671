"""Time along a path: running at rate 1, and a stop on the path by a fixed symmetric rate curve.

With q(s) the path and r = ds/dt its rate: v = q' r, a = q'' r^2 + q' r', j = q''' r^3 + 3 q'' r r' + q' r''.
A stop of duration D takes r from 1 to 0 by 1 - 3x^2 + 2x^3, x = t/D, over D/2 of the path.
"""

from .closed_forms import Array


def derivatives(q1: Array, q2: Array, q3: Array, rate: float, rate1: float, rate2: float) -> tuple[Array, Array, Array]:
    """Velocity, acceleration, jerk [n] by time from the derivatives by s and the rate with its first two by time."""
    v = q1 * rate
    a = q2 * (rate * rate) + q1 * rate1
    j = q3 * (rate * rate * rate) + q2 * (3.0 * rate * rate1) + q1 * rate2
    return v, a, j


class PathClock:
    """Path parameter `s`, its `rate` (ds/dt), `rate1` and `rate2` (the rate's derivatives by time) at the present tick.

    Only whole ticks are counted: while running s is their product with dt, while stopping a closed form from the stop's
    beginning. No error accumulates, and the same ticks give the same bits.
    """

    def __init__(self, s: float = 0.0) -> None:
        self.s = s
        self.rate, self.rate1, self.rate2 = 1.0, 0.0, 0.0
        self._dt = 0.0
        self._base = s  # s where the present count of ticks began
        self._ticks = 0
        self._elapsed = 0.0  # time in a stop before the present count of ticks
        self._stop_duration: float | None = None

    @property
    def stopping(self) -> bool:
        """A stop has begun (and may have ended)."""
        return self._stop_duration is not None

    @property
    def at_rest(self) -> bool:
        """The rate is 0 for good."""
        return self.rate == 0.0

    def advance(self, dt: float, ticks: int = 1) -> None:
        """Go on by `ticks` ticks of dt: more than one if the loop skipped some."""
        if dt != self._dt:
            self._rebase(dt)
        self._ticks += ticks
        if self._stop_duration is None:
            self.s = self._base + self._ticks * dt
        else:
            self._slow(self._elapsed + self._ticks * dt, self._stop_duration)

    def stop(self, duration: float) -> None:
        """Begin at the present tick to slow to rest within `duration` (of a StopTable); 0 rests at once.

        A stop that has begun is not changed by another one.
        """
        if self._stop_duration is not None:
            return
        self._stop_duration = duration
        self._base, self._ticks = self.s, 0
        self._slow(0.0, duration)

    def _rebase(self, dt: float) -> None:
        if self._stop_duration is None:
            self._base = self.s
        else:
            self._elapsed += self._ticks * self._dt
        self._ticks, self._dt = 0, dt

    def _slow(self, elapsed: float, duration: float) -> None:
        if elapsed >= duration:
            self.s = self._base + 0.5 * duration
            self.rate = self.rate1 = self.rate2 = 0.0
            return
        x = elapsed / duration
        self.s = self._base + duration * (x - x * x * x + 0.5 * x * x * x * x)
        self.rate = 1.0 - x * x * (3.0 - 2.0 * x)
        self.rate1 = -6.0 * x * (1.0 - x) / duration
        self.rate2 = (12.0 * x - 6.0) / (duration * duration)
