"""How long a stop on the path takes, beside the time-optimal stop of the slowest axis alone: no service is needed."""

from collections.abc import Iterable, Iterator
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray
from percentiles import Distribution
from report import Report

from axisync_motion import Minimise, PathClock, RateTables, Trajectory, from_profiles, rate_tables, synchronise
from axisync_motion.s_curve import Pulse
from support.stops import alone

Array = NDArray[np.float64]

AXES, PERIOD = 6, 0.002
LIMITS = tuple(np.radians([[30.0], [40.0], [80.0]]) * np.ones(AXES))
STOPS = tuple(np.radians([[60.0], [240.0]]) * np.ones(AXES))
"""Of the demo's arms."""
MAPS: tuple[Minimise, ...] = ("acceleration", "velocity", "jerk")
PULSES: tuple[Pulse, ...] = ("constant", "constant", "parabolic")
STOPS_PER_MOVE = 4


def measure(report: Report, moves: int = 250, lines: Iterable[Trajectory] = ()) -> None:
    """Measures and prints ratios, what a tick costs, and what the tables cost: of joint moves, and of tool lines."""
    rows: dict[str, tuple[list[float], list[float], list[float]]] = {}
    for name, paths in (("joint", joint_moves(moves)), ("lines of the tool", iter(lines))):
        ratios, ticks, tables = [], [], []
        for number, path in enumerate(paths):
            begin = perf_counter_ns()
            found = rate_tables(path, *LIMITS, *STOPS)
            tables.append((perf_counter_ns() - begin) / 1e6)
            for s in np.random.default_rng(number).uniform(0.0, path.duration, STOPS_PER_MOVE).tolist():
                count, times = stop(path, found, s)
                ratios.append(count * PERIOD / best(path, s))
                ticks += times
        if ratios:
            rows[name] = ratios, ticks, tables
    for index, (key, title, unit) in enumerate((
        ("stop ratio", "Time of a stop over that of the slowest axis alone", "ratio"),
        ("stop ticks", "One tick of the path clock while it stops", "us"),
        ("stop tables", "Tables of a move", "ms"),
    )):  # fmt: skip
        found_rows = {name: Distribution.of(row[index]) for name, row in rows.items()}
        report.distributions(key, title, unit, found_rows, (50, 90, 99))


def joint_moves(count: int) -> Iterator[Trajectory]:
    """By distances of up to 0.2, 1 or 3 rad."""
    rng = np.random.default_rng(6)
    for _ in range(count):
        distances = rng.uniform(-1.0, 1.0, AXES) * rng.choice([0.2, 1.0, 3.0])
        minimise, pulse = MAPS[rng.integers(len(MAPS))], PULSES[rng.integers(len(PULSES))]
        v, a, j = LIMITS
        yield from_profiles(np.zeros(AXES), synchronise(distances, v, a, j, minimise, pulse=pulse))


def best(path: Trajectory, s: float) -> float:
    """Time of the slowest axis's own stop from s, s."""
    _, v, a, _ = path.evaluate(s)
    return max(alone(*axis) for axis in zip(v.tolist(), a.tolist(), *STOPS, strict=True))


def stop(path: Trajectory, tables: RateTables, s: float) -> tuple[int, list[float]]:
    """Ticks that a stop from s takes, and what each costs, us."""
    clock, times = PathClock(path, tables, PERIOD, s), []
    clock.stop()
    while not clock.at_rest:
        begin = perf_counter_ns()
        clock.advance()
        times.append((perf_counter_ns() - begin) / 1e3)
    return len(times), times
