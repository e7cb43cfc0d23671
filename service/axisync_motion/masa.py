"""MASA, section IV.D: all axes of a move start together and arrive together."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from struct import Struct
from struct import error as StructError

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .backends import kernels
from .checks import check_axis, check_duration, floats
from .closed_forms import (
    ANY_DURATION,
    DISTANCE_MAX,
    DISTANCE_MIN,
    DURATION_MAX,
    DURATION_TOLERANCE,
    REFUSED,
    Array,
    prepare,
    shape,
    shortest,
    signed_peak,
)
from .errors import InfeasibleDuration
from .inverse import MINIMISE_CODES, Minimise, shape_map
from .s_curve import PARABOLIC, Curve, Profile, Pulse, mean_jerk, sample_curves
from .time_optimal import duration as shortest_duration

Vector = Sequence[float] | NDArray[np.float64]

DISTANCES, MINIMUM, ROWS = 3, 4, 6  # of the table of a move, see closed_forms.plan_move


class SyncProfile:
    """The motion of n axes from 0 to `distances`, all of the same duration, in any consistent units.

    T[n, 7] segment durations and U[n, 7] signed peak jerks.
    """

    # No dataclass, and what few ask for made only then: a move is planned in the time that takes.
    __slots__ = ("T", "U", "_table", "duration", "pulse")

    def __init__(self, series: Array, inputs: Array, duration: float, table: Array, pulse: Pulse) -> None:
        self.T = series
        self.U = inputs
        self.duration = duration
        self.pulse: Pulse = pulse
        self._table = table

    @property
    def distances(self) -> Array:
        """[n], signed, as given."""
        distances: Array = self._table[DISTANCES]
        return distances

    @property
    def minimum_durations(self) -> Array:
        """[n], each axis's own shortest duration."""
        minimum: Array = self._table[MINIMUM]
        return minimum

    @property
    def limiting(self) -> int:
        """The (first) axis with the longest minimum duration."""
        return int(self._table[MINIMUM].argmax())

    def curve(self) -> Curve[Array]:
        """Parameters for sampling, arrays [n]."""
        tj, ta, j, distances = self.T[:, 0], self.T[:, 1], self.U[:, 0], self.distances
        busy = tj + ta + tj + self.T[:, 3]
        velocity = np.divide(distances, busy, out=np.zeros_like(busy), where=busy > 0.0)
        acceleration = (j if self.pulse == "constant" else j * 2.0 / 3.0) * tj
        return Curve(tj, ta, acceleration, velocity, j, distances, np.full_like(tj, self.duration))

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration, jerk at time t (a float or an array): arrays [*t.shape, n].

        Exact; before 0 and from `duration` on at rest at 0 and at `distances`.
        """
        times = np.asarray(t, dtype=np.float64)[..., np.newaxis]
        states = sample_curves(times, self.curve(), self.pulse)
        return states[0], states[1], states[2], states[3]

    def axis(self, index: int) -> Profile:
        """The profile of one axis."""
        tj, ta, _, tv = self.T[index, :4].tolist()
        j = float(self.U[index, 0])
        series = (tj, ta, tj, tv, tj, ta, tj)
        distance = float(self.distances[index])
        return Profile(series, (j, 0.0, -j, 0.0, -j, 0.0, j), self.duration, distance, self.pulse)

    def __repr__(self) -> str:
        distances = self.distances.tolist()
        return f"SyncProfile(duration={self.duration!r}, distances={distances!r}, pulse={self.pulse!r})"


def synchronise(
    distances: Vector,
    v_max: Vector,
    a_max: Vector,
    j_max: Vector,
    minimise: Minimise = "acceleration",
    duration: float | None = None,
    pulse: Pulse = "constant",
) -> SyncProfile:
    """MASA: the move of n >= 1 axes over signed distances [n] within limits [n], in any consistent units.

    The slowest axis sets the time and keeps its time-optimal motion, and so do axes that need just as long; the
    others take the inverse map that `minimise` names. With a longer `duration` all axes take that map.
    Raises InvalidLimits, InfeasibleDuration (naming the slowest axis), and ValueError for wrong shapes.
    """
    try:
        code, parabolic = MINIMISE_CODES[minimise], PARABOLIC[pulse]
    except KeyError:
        shape_map(minimise), mean_jerk(1.0, pulse)
        raise
    compiled = kernels()
    plan_move = _plan_move if compiled is None else compiled.plan_move
    table = _table(distances, v_max, a_max, j_max)
    n = table.shape[1]
    series, inputs = np.empty((n, 7)), np.empty((n, 7))
    requested = ANY_DURATION if duration is None else float(duration)
    t = REFUSED
    if duration is None or 0.0 <= requested <= DURATION_MAX:
        t = plan_move(table, code, requested, parabolic, series, inputs)
    if t == REFUSED:
        raise _refusal(_table(distances, v_max, a_max, j_max), duration, pulse)
    return SyncProfile(series, inputs, t, table, pulse)


def _table(d: Vector, v: Vector, a: Vector, j: Vector) -> Array:
    """Its first rows as plan_move takes them; ValueError for wrong shapes."""
    if type(d) is type(v) is type(a) is type(j) is list and len(d) == len(v) == len(a) == len(j) > 0:
        table = np.empty((ROWS, len(d)))
        try:
            _packer(4 * len(d))(table, 0, *v, *a, *j, *d)
        except StructError:
            pass  # not floats; what they are is said below
        else:
            return table
    plain = floats("distances", d)
    n = len(plain)
    if n == 0:
        raise ValueError("distances: at least one axis is needed")
    table = np.empty((ROWS, n))
    limits = floats("v_max", v, n) + floats("a_max", a, n) + floats("j_max", j, n)
    _packer(4 * n)(table, 0, *limits, *plain)
    return table


@lru_cache(maxsize=64)
def _packer(count: int) -> Callable[..., None]:
    """Writes floats into an array, several times as fast as numpy."""
    return Struct(f"{count}d").pack_into


def _plan_move(table: Array, minimise: int, requested: float, parabolic: bool, series: Array, inputs: Array) -> float:
    """As closed_forms.plan_move, on floats instead of elements of arrays."""
    v, a, j, d = table[:4].tolist()
    if not prepare(v, a, j, parabolic):
        return REFUSED
    sizes = list(map(abs, d))
    for x in sizes:
        if not (DISTANCE_MIN <= x <= DISTANCE_MAX or x == 0.0):
            return REFUSED
    own = list(map(shortest, sizes, v, a, j))
    t = max(own)
    if t > DURATION_MAX or (requested != ANY_DURATION and requested < t * (1.0 - DURATION_TOLERANCE)):
        return REFUSED
    t = max(t, requested)
    times: list[float] = []
    jerks: list[float] = []
    for i, (least, x, vi, ai, ji) in enumerate(zip(own, sizes, v, a, j, strict=True)):
        tj, ta, tv, mean = shape(minimise, t, least, x, vi, ai, ji)
        up = signed_peak(mean, d[i], parabolic)
        down = -up
        times += tj, ta, tj, tv, tj, ta, tj
        jerks += up, 0.0, down, 0.0, down, 0.0, up
    _packer(len(times))(series, 0, *times)
    _packer(len(jerks))(inputs, 0, *jerks)
    table[MINIMUM] = own
    return t


def _refusal(table: Array, requested: float | None, pulse: Pulse) -> ValueError:
    """Why plan_move refuses these limits and distances; raises or returns it."""
    v, a, j, d = table[:4].tolist()
    for i, axis in enumerate(zip(d, v, a, j, strict=True)):
        check_axis(*axis, i)
    minimum = [shortest_duration(*axis, pulse=pulse) for axis in zip(d, v, a, j, strict=True)]
    t = max(minimum)
    limiting = minimum.index(t)
    check_duration(t, limiting)
    assert requested is not None
    check_duration(requested)
    return InfeasibleDuration(requested, t, limiting)
