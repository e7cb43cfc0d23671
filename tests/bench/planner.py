"""How fast the planner is, on both of its backends, beside the Ruckig library: no service is needed."""

from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from time import perf_counter_ns
from typing import Any

import numpy as np
from numpy.typing import NDArray
from percentiles import Distribution
from report import Report

from axisync_motion import (
    Evaluator,
    Trajectory,
    from_profiles,
    rate_tables,
    synchronise,
    synchronise_batch,
    time_optimal,
    use_backend,
)

Array = NDArray[np.float64]
Planner = Callable[[list[float]], object]

AXES = 6
LIMITS = [30.0] * AXES, [40.0] * AXES, [80.0] * AXES
"""Of the paper's arm, in degrees."""
BLOCK = 50
"""Moves planned by one planner before it is the next one's turn."""
RUCKIG, RUCKIG_ALONE = "Ruckig", "calculate"
"""Calculation and reading of the profiles, and without reading anything."""


def measure(report: Report, moves: int = 5_000, batch: int = 100_000, rounds: int = 9) -> None:
    """Measures and prints: single moves, batches of moves, and what else a request and the loop wait for."""
    backends = usable_backends()
    ruckig = _ruckig()
    report.say(f"planning with {' and '.join(backends)}, {'beside' if ruckig else 'without'} Ruckig")
    if ruckig:
        report.say("Ruckig: calculation and reading of its profiles; calculate: without reading them")
    if "numba" not in backends:
        report.say("numba cannot be used: install the extra `fast`")
    planners = dict.fromkeys(backends, _plan) | ({} if ruckig is None else _ruckigs(ruckig))
    singles = {name: Distribution.of(times) for name, times in single_moves(planners, moves).items()}
    title = f"One {AXES}-axis move, floats in, T and U out"
    report.distributions("planner moves", title, "us", singles, (50, 99), _ratios(singles))
    rates = {name: Distribution.of(values) for name, values in batches(backends, ruckig, batch, rounds).items()}
    title = f"{batch:,} {AXES}-axis moves at once"
    report.distributions("planner batches", title, "1,000/s", rates, (50,), _ratios(rates))
    others = {name: Distribution.of(times) for name, times in parts(backends, rounds)}
    report.distributions("planner parts", "12 axes moving for 5 s", "us", others, (50, 99))
    use_backend("auto")


def usable_backends() -> list[str]:
    """ "numba" if it can be used, and "python"."""
    return list(dict.fromkeys([use_backend("auto"), use_backend("python")]))


def _ruckig() -> Any:
    try:
        return import_module("ruckig")
    except ImportError:
        return None


def _ratios(rows: dict[str, Distribution]) -> dict[str, dict[str, object]]:
    """Medians over those of each of Ruckig's rows."""
    return {
        f"/ {column}": {name: f"{row.percentile(50) / rows[column].percentile(50):.2f}" for name, row in rows.items()}
        for column in (RUCKIG, RUCKIG_ALONE)
        if column in rows
    }


def _plan(distances: list[float]) -> object:
    move = synchronise(distances, *LIMITS)
    return move.T, move.U


def _ruckigs(ruckig: Any) -> dict[str, Planner]:
    planner, trajectory, query = ruckig.Ruckig(AXES), ruckig.Trajectory(AXES), ruckig.InputParameter(AXES)
    query.max_velocity, query.max_acceleration, query.max_jerk = LIMITS

    def calculate(distances: list[float]) -> object:
        query.target_position = distances
        return planner.calculate(query, trajectory)

    def read(distances: list[float]) -> object:
        calculate(distances)
        return [(profile.t, profile.j) for profile in trajectory.profiles[0]]

    return {RUCKIG: read, RUCKIG_ALONE: calculate}


def _distances(count: int) -> Array:
    return np.random.default_rng(1).uniform(-120.0, 120.0, (count, AXES))


def single_moves(planners: dict[str, Planner], moves: int) -> dict[str, list[float]]:
    """Microseconds of each call; the planners take turns, block by block, all with the same moves."""
    times: dict[str, list[float]] = {name: [] for name in planners}
    distances = _distances(moves).tolist()
    for first in range(0, moves, BLOCK):
        for name, plan in planners.items():
            if name in ("numba", "python"):
                use_backend(name)
            plan(distances[first])  # unmeasured: what ran before has taken the caches
            for row in distances[first : first + BLOCK]:
                begin = perf_counter_ns()
                plan(row)
                times[name].append((perf_counter_ns() - begin) / 1e3)
    return times


def batches(backends: list[str], ruckig: Any, batch: int, rounds: int) -> dict[str, list[float]]:
    """Thousand moves a second of each round; Ruckig has no batches, so a loop over a twentieth of them."""
    distances = _distances(batch)
    rows = distances[: -(-batch // 20)].tolist()
    loops = {} if ruckig is None else _ruckigs(ruckig)
    rates: dict[str, list[float]] = {name: [] for name in (*backends, *loops)}
    for _ in range(rounds):
        for name in backends:
            use_backend(name)
            rates[name].append(1e-3 * batch / _seconds(lambda: synchronise_batch(distances, *LIMITS)))
        for name, plan in loops.items():
            rates[name].append(1e-3 * len(rows) / _seconds(partial(_each, plan, rows)))
    return rates


def _each(plan: Planner, rows: list[list[float]]) -> None:
    for row in rows:
        plan(row)


def parts(backends: list[str], rounds: int) -> Iterator[tuple[str, list[float]]]:
    """Name and microseconds of what else is waited for, 12 axes, a trajectory of 5 s."""
    v, a, j = np.full(12, 0.5236), np.full(12, 0.6981), np.full(12, 1.3963)
    target = np.random.default_rng(2).uniform(-1.5, 1.5, 12)
    profile = synchronise(target, v, a, j, duration=5.0)
    path = from_profiles(np.zeros(12), profile, target)
    yield "F of one axis (time_optimal)", _times(lambda: time_optimal(100.0, 30.0, 40.0, 80.0), 200 * rounds)
    yield "Evaluator.at, a tick apart", evaluations(path)
    yield "from_profiles", _times(lambda: from_profiles(np.zeros(12), profile, target), 5 * rounds)
    for name in backends:
        use_backend(name)
        yield f"rate_tables, {name}", _times(lambda: rate_tables(path, v, a, j, 1.5 * a, 3.0 * j), 2 * rounds)


def evaluations(path: Trajectory, period: float = 0.002) -> list[float]:
    """Microseconds of Evaluator.at over the whole path, one tick after the other."""
    evaluator = Evaluator(path)
    times = []
    for s in np.arange(0.0, path.duration, period).tolist():
        begin = perf_counter_ns()
        evaluator.at(s)
        times.append((perf_counter_ns() - begin) / 1e3)
    return times


def _times(call: Callable[[], object], count: int) -> list[float]:
    call()
    return [_seconds(call) * 1e6 for _ in range(count)]


def _seconds(call: Callable[[], object]) -> float:
    begin = perf_counter_ns()
    call()
    return (perf_counter_ns() - begin) / 1e9
