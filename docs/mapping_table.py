"""What each mapping buys: random moves of KingKong, planned by MASA with each inverse map and by Ruckig."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import ruckig  # type: ignore[import-not-found, unused-ignore]  # compiled, without type information
from numpy.typing import NDArray

from axisync_motion import Minimise, Pulse, synchronise_batch

Array = NDArray[np.float64]

MOVES, AXES, SEED = 1000, 6, 20
V, A, J = (np.full(AXES, limit) for limit in (30.0, 40.0, 80.0))
"""Of every axis: deg/s, deg/s^2, deg/s^3."""
SOFT_LIMIT_DEG = 170.0
MEAN = {"constant": 1.0, "parabolic": 2.0 / 3.0}
MEAN_SQUARE = {"constant": 1.0, "parabolic": 8.0 / 15.0}
"""Of a jerk pulse over its peak, and of their squares."""
CRITICAL = 1.0 - 1e-9
"""An axis whose own time is this share of the move's has nothing to spare, whatever the map."""
MAPPINGS: tuple[tuple[str, Minimise, Pulse], ...] = (
    ("f_V^-1", "velocity", "constant"),
    ("f_A^-1", "acceleration", "constant"),
    ("f_J^-1", "jerk", "constant"),
    ("f_A^-1, parabolic", "acceleration", "parabolic"),
    ("f_J^-1, parabolic", "jerk", "parabolic"),
)


class Effort(NamedTuple):
    """Of m moves: durations [m]; of their axes [m, n]: largest magnitudes and the integral of the squared jerk."""

    duration: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    jerk_square: Array


class Ratios(NamedTuple):
    """To Ruckig's: of mean durations, medians over synchronised axes, and of summed jerk^2 integrals."""

    duration: float
    velocity: float
    acceleration: float
    jerk: float
    jerk_square: float
    jerk_square_all: float


def anywhere(rng: np.random.Generator) -> Array:
    """Distances between two positions drawn evenly from within the soft limits, deg."""
    begin, end = rng.uniform(-SOFT_LIMIT_DEG, SOFT_LIMIT_DEG, (2, MOVES, AXES))
    return np.asarray(end - begin)


def up_to(largest: float) -> Callable[[np.random.Generator], Array]:
    """Distances of every axis drawn evenly from +- `largest` deg."""

    def draw(rng: np.random.Generator) -> Array:
        return np.asarray(rng.uniform(-largest, largest, (MOVES, AXES)))

    return draw


def effort(times: Array, jerks: Array, duration: Array, pulse: Pulse) -> Effort:
    """Of T and U [m, n, k], of segments between which acceleration and velocity have their extremes."""
    change = jerks * MEAN[pulse] * times
    after = np.cumsum(change, axis=2)
    velocity = np.cumsum((after - 0.5 * change) * times, axis=2)
    v, a, j = (np.abs(values).max(axis=2) for values in (velocity, after, jerks))
    return Effort(duration, v, a, j, MEAN_SQUARE[pulse] * (jerks**2 * times).sum(axis=2))


def of_ruckig(distances: Array) -> tuple[Effort, NDArray[np.bool_]]:
    """Ruckig's time synchronisation of moves [m, n], and which axes had time to spare."""
    planner, trajectory, query = ruckig.Ruckig(AXES), ruckig.Trajectory(AXES), ruckig.InputParameter(AXES)
    query.max_velocity, query.max_acceleration, query.max_jerk = (x.tolist() for x in (V, A, J))
    times, jerks = np.empty((2, *distances.shape, 7))
    durations, own = np.empty(len(distances)), np.empty(distances.shape)
    for k, target in enumerate(distances.tolist()):
        query.target_position = target
        result = planner.calculate(query, trajectory)
        if result not in (ruckig.Result.Working, ruckig.Result.Finished):
            raise RuntimeError(f"Ruckig refuses {target}: {result}")
        times[k] = [profile.t for profile in trajectory.profiles[0]]
        jerks[k] = [profile.j for profile in trajectory.profiles[0]]
        durations[k], own[k] = trajectory.duration, trajectory.independent_min_durations
    return effort(times, jerks, durations, "constant"), own < CRITICAL * durations[:, np.newaxis]


def of_masa(distances: Array, minimise: Minimise, pulse: Pulse) -> Effort:
    """The same moves by MASA."""
    return effort(*synchronise_batch(distances, V, A, J, minimise, pulse=pulse), pulse)


def ratios(ours: Effort, theirs: Effort, synchronised: NDArray[np.bool_]) -> Ratios:
    """How `ours` compares where there was time to spare."""
    pairs = zip(ours[1:4], theirs[1:4], strict=True)
    v, a, j = (float(np.median((one / other)[synchronised])) for one, other in pairs)
    one, other = ours.jerk_square, theirs.jerk_square
    total = one[synchronised].sum() / other[synchronised].sum()
    return Ratios(ours.duration.mean() / theirs.duration.mean(), v, a, j, total, one.sum() / other.sum())


def main_table() -> str:
    """Every mapping, over moves from anywhere to anywhere."""
    distances = anywhere(np.random.default_rng(SEED))
    theirs, synchronised = of_ruckig(distances)
    peaks = [np.median(values[synchronised]) for values in theirs[1:4]]
    lines = [
        "| | duration | peak velocity | peak acceleration | peak jerk | jerk² integral | of all axes |",
        "|---|---|---|---|---|---|---|",
        f"| Ruckig | {theirs.duration.mean():.2f} s | {peaks[0]:.1f} deg/s | {peaks[1]:.1f} deg/s² "
        f"| {peaks[2]:.1f} deg/s³ | 1 | 1 |",
    ]
    for name, minimise, pulse in MAPPINGS:
        row = ratios(of_masa(distances, minimise, pulse), theirs, synchronised)
        lines.append(f"| {name} | " + " | ".join(f"{value:.3f}" for value in row) + " |")
    return "\n".join(lines)


def size_table() -> str:
    """How much of that depends on how far the axes go."""
    draws = [(f"± {size:g} deg", up_to(size)) for size in (10.0, 45.0, 90.0, 120.0, 150.0, 180.0)]
    lines = [
        "| distances | f_A^-1: jerk² integral | f_J^-1: jerk² integral | f_J^-1: peak jerk, median |",
        "|---|---|---|---|",
    ]
    for label, draw in (*draws, ("anywhere to anywhere", anywhere)):
        distances = draw(np.random.default_rng(SEED))
        theirs, synchronised = of_ruckig(distances)
        gentle = ratios(of_masa(distances, "acceleration", "constant"), theirs, synchronised)
        smooth = ratios(of_masa(distances, "jerk", "constant"), theirs, synchronised)
        lines.append(f"| {label} | {gentle.jerk_square:.3f} | {smooth.jerk_square:.3f} | {smooth.jerk:.3f} |")
    return "\n".join(lines)
