"""A motion q(x(t)) given as a function of time, as a trajectory: polynomials through Chebyshev points of short pieces.

q must be smooth in the scalars x, whose own motion is a trajectory; at its knots derivatives may jump. Interpolation
at Chebyshev points converges so fast that a piece's last coefficients say how good it is: they bound what is left out,
and pieces where they are too large are halved. Neighbouring pieces share their end points, so positions have no jumps;
derivatives have none but the error of the fit.

Between knots that are very close, positions say nothing of the jerk: rounding, over the cube of the width, is more.
There the neighbour's polynomial goes on, and what the scalars do otherwise than in the neighbour is added by dq/dx.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from .closed_forms import Array
from .path_bounds import expanded
from .trajectory import Trajectory

DEGREE = 7
PIECE_S = 0.12
"""Longest piece: a tenth of what an arm needs for anything, so that few are ever halved."""
PIECES = 256
"""A long motion begins with no more than these and its segments: it is slow, and what is not is halved."""
PIECES_MAX = 16384
"""More is not smooth, or nothing that could be played."""
ROUNDING = 1e-15
"""Of a position, rad."""
MARGIN = 2.0
"""Segments are short that are not wider by this than where rounding is as much as is tolerated."""
JERK_SHARE = 1e-3
"""Of the jerk that the motion has in any case: finer is not asked for."""


class NotSmooth(ValueError):
    """The function has a kink or a jump between knots, at about `time`; `axis` is the worst."""

    def __init__(self, time: float, axis: int) -> None:
        self.time, self.axis = time, axis
        super().__init__(f"axis {axis} is not smooth at {time:.6g}")


def fit(
    function: Callable[[Array], Array],
    scalars: Trajectory,
    slope: Callable[[float, Array], Array],
    position_tolerance: ArrayLike,
    jerk_tolerance: ArrayLike,
    start: ArrayLike,
) -> Trajectory:
    """The trajectory of `function`, which gives positions [k, n] at increasing times [k].

    It is a smooth function of `scalars` [m]; `slope` gives its derivatives by them, [n, m], at a time and position [n].
    Positions are right within `position_tolerance`[n], third derivatives within `jerk_tolerance`[n] or a thousandth of
    what the motion needs at least, as far as rounding lets them. The first position is `start`[n] to the bit.

    Raises:
        NotSmooth: pieces would have to be shorter than rounding allows.
    """
    edges = _pieces(scalars.knots)
    first, position, jerk = (np.asarray(x, dtype=np.float64) for x in (start, position_tolerance, jerk_tolerance))
    while True:
        coefficients, values = _interpolate(function, edges, first)
        widths = np.diff(edges)
        bound = np.maximum(jerk, JERK_SHARE * _least_jerk(values, scalars.duration))
        shortest = _shortest(bound)
        short = np.diff(scalars.knots)[_segments(edges, scalars)] < MARGIN * shortest
        wrong = _excess(coefficients, widths, position, bound)
        poor = (wrong.max(axis=(1, 2)) > 1.0) & ~short
        halved = poor & (widths >= 2.0 * shortest)
        if not halved.any():
            _refuse_jumps(wrong[..., 0], edges, short)
            break
        if edges.size + halved.sum() > PIECES_MAX:
            worst = int(wrong.max(axis=(1, 2)).argmax())
            raise NotSmooth(float(edges[worst]), int(wrong[worst].max(axis=-1).argmax()))
        middles = 0.5 * (edges[:-1] + edges[1:])[halved]
        edges = np.sort(np.concatenate([edges, middles]))
    plain = _powers(edges, coefficients)
    for begin, end in _runs(short):
        _carry_on(plain, edges, (begin, end), scalars, slope, values)
    plain[0, 0] = first
    return Trajectory(edges, plain, first.copy(), values[-1].copy())


def stretched(trajectory: Trajectory, factor: float) -> Trajectory:
    """The same curve, `factor` times as slow: velocity by 1/factor, acceleration by its square, jerk by its cube."""
    powers = factor ** -np.arange(trajectory.coefficients.shape[1], dtype=np.float64)
    return Trajectory(
        trajectory.knots * factor, trajectory.coefficients * powers[:, np.newaxis], trajectory.start, trajectory.end
    )


def _pieces(knots: Array) -> Array:
    widths = np.diff(knots)
    longest = max(PIECE_S, float(knots[-1]) / PIECES)
    counts = np.maximum(1, np.ceil(widths / longest - 1e-9)).astype(np.intp)
    parts = [
        np.linspace(low, high, count, endpoint=False)
        for low, high, count in zip(knots[:-1], knots[1:], counts.tolist(), strict=True)
    ]
    return np.append(np.concatenate(parts), knots[-1])


def _segments(edges: Array, scalars: Trajectory) -> NDArray[np.intp]:
    """[pieces] which segment of the scalars each is in."""
    middles = 0.5 * (edges[:-1] + edges[1:])
    return np.searchsorted(scalars.knots, middles, side="right") - 1


def _least_jerk(values: Array, duration: float) -> Array:
    """[n]: from rest to rest over that distance in that time there is no motion with less."""
    travel: Array = np.ptp(values, axis=0)
    return 32.0 * travel / duration**3


def _shortest(jerk: Array) -> float:
    """Width of a piece in which rounding is as much as the jerk tolerated."""
    return float((STEEP * 8.0 * LEAK * ROUNDING / jerk.min()) ** (1.0 / 3.0))


def _interpolate(function: Callable[[Array], Array], edges: Array, start: Array) -> tuple[Array, Array]:
    """Chebyshev coefficients [pieces, DEGREE+1, n], and the positions that they go through."""
    x, to_chebyshev, _ = _matrices()
    widths = np.diff(edges)
    times = np.append((edges[:-1, np.newaxis] + widths[:, np.newaxis] * x[:-1]).ravel(), edges[-1])
    values = function(times)
    values[0] = start
    index = DEGREE * np.arange(widths.size)[:, np.newaxis] + np.arange(DEGREE + 1)
    return to_chebyshev @ values[index], values


def _excess(coefficients: Array, widths: Array, position: Array, jerk: Array) -> Array:
    """[pieces, n, 2]: what the last coefficients stand for in position and jerk, over what is tolerated.

    The fit leaves out less than its last terms where it converges; of its third derivative, T_n'''(1) as much.
    """
    last = np.abs(coefficients[:, -1]) + np.abs(coefficients[:, -2]) * LEAK
    steep = STEEP * (2.0 / widths) ** 3
    return np.stack([last / position, last * LEAK * steep[:, np.newaxis] / jerk], axis=-1)


LEAK = 0.1
"""A smooth piece's coefficients fall at least so fast from one to the next; one that is 0 by symmetry hides nothing."""
STEEP = DEGREE**2 * (DEGREE**2 - 1) * (DEGREE**2 - 4) / 15.0
"""T_n'''(1)."""


def _refuse_jumps(wrong: Array, edges: Array, short: NDArray[np.bool_]) -> None:
    """
    Raises:
        NotSmooth: positions [pieces, n] are wrong where pieces cannot be halved any more.
    """
    worst = np.where(short, 0.0, wrong.max(axis=1))
    if worst.max() > 1.0:
        at = int(worst.argmax())
        raise NotSmooth(float(edges[at]), int(wrong[at].argmax()))


def _powers(edges: Array, coefficients: Array) -> Array:
    *_, to_powers = _matrices()
    scale = np.diff(edges)[:, np.newaxis] ** -np.arange(DEGREE + 1)
    plain: Array = (to_powers @ coefficients) * scale[:, :, np.newaxis]
    return plain


def _runs(short: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Begin and end of each run of short pieces."""
    turns = np.flatnonzero(np.diff(np.concatenate([[False], short, [False]])))
    return [(int(begin), int(end)) for begin, end in turns.reshape(-1, 2)]


def _carry_on(
    plain: Array,
    edges: Array,
    run: tuple[int, int],
    scalars: Trajectory,
    slope: Callable[[float, Array], Array],
    values: Array,
) -> None:
    """Fills in the pieces of a run, from the rest before or behind it, or the wider of its neighbours."""
    begin, end = run
    left, right = begin - 1, end if end < len(plain) else -1
    of = _segments(edges, scalars)
    if left < 0 or right < 0:
        at = 0 if left < 0 else len(plain)
        near, driver = np.zeros(plain.shape[1:]), np.zeros(scalars.coefficients.shape[1:])
        near[0], driver[0] = values[DEGREE * at], scalars.sample([0.0 if at == 0 else scalars.duration])[0][0]
        from_near = from_driver = float(edges[at])
    else:
        piece = left if edges[begin] - edges[left] >= edges[right + 1] - edges[end] else right
        at = (begin + end) // 2
        near, from_near = plain[piece], float(edges[piece])
        driver, from_driver = scalars.coefficients[of[piece]], float(scalars.knots[of[piece]])
    by = slope(float(edges[at]), values[DEGREE * at]).T
    for piece in range(begin, end):
        here = edges[piece : piece + 1]
        own = expanded(scalars.coefficients[of[piece]][np.newaxis], here - scalars.knots[of[piece]])[0]
        other = expanded(driver[np.newaxis], here - from_driver)[0]
        plain[piece] = expanded(near[np.newaxis], here - from_near)[0]
        plain[piece, : own.shape[0]] += (own - other) @ by


@lru_cache(maxsize=1)
def _matrices() -> tuple[Array, Array, Array]:
    """Points in [0, 1]; what makes Chebyshev coefficients of values there; what makes coefficients of powers of x."""
    count = DEGREE + 1
    points = -np.cos(np.pi * np.arange(count) / DEGREE)
    to_chebyshev: Array = np.linalg.inv(chebyshev.chebvander(points, DEGREE)).astype(np.float64)
    to_powers = np.zeros((count, count))
    for k in range(count):
        series = chebyshev.Chebyshev.basis(k, domain=[0.0, 1.0]).convert(kind=np.polynomial.Polynomial)
        to_powers[: k + 1, k] = series.coef
    return 0.5 * (points + 1.0), to_chebyshev, to_powers
