"""Any commands at any time on any path: limits at every tick, by the formulas and by differences; never backwards."""

from dataclasses import dataclass

import numpy as np
import pytest

from axisync_motion import PathClock, Trajectory, concatenate, derivatives, from_profiles, rate_tables, synchronise
from support.stops import alone

MAPS = ["acceleration", "velocity", "jerk"]
ROUNDING = 1e-6
SCRIPTS = 24
RELAXED_SHARE = 0.02


@dataclass
class Move:
    path: Trajectory
    moves: np.ndarray
    """[3, n] v, a, j"""
    stops: np.ndarray
    """[3, n] v, a, j"""

    def clock(self, period: float, s: float = 0.0) -> PathClock:
        return PathClock(self.path, rate_tables(self.path, *self.moves, *self.stops[1:]), period, s)


def move(rng: np.random.Generator) -> Move:
    n = int(rng.integers(1, 7))
    limits = np.array([0.52, 0.7, 1.4])[:, np.newaxis] * rng.uniform(0.6, 1.6, (3, n))
    factors = np.array([1.0, rng.uniform(1.3, 2.0), rng.uniform(2.5, 4.0)])[:, np.newaxis]

    def leg(start: np.ndarray) -> Trajectory:
        distances = rng.uniform(-1.0, 1.0, n) * rng.choice([0.2, 1.0, 3.0])
        pulse = str(rng.choice(["constant", "constant", "parabolic"]))
        return from_profiles(start, synchronise(distances, *limits, str(rng.choice(MAPS)), pulse=pulse))

    path = leg(np.zeros(n))
    if rng.random() < 0.3:
        path = concatenate([path, leg(path.end)], [float(rng.choice([0.0, 0.4]))])
    return Move(path, limits, limits * factors)


def script(clock: PathClock, rng: np.random.Generator, ticks: int) -> tuple[np.ndarray, np.ndarray]:
    """State [k, 4] and whether the stop limits applied [k], under random commands."""
    every = int(rng.choice([1, 3, 30, 300]))
    rows, relaxed = [], []
    for tick in range(ticks):
        if tick % every == 0:
            draw = rng.random()
            if draw < 0.4:
                clock.set_override(float(rng.choice([0.0, 0.3, 1.0, rng.random()])))
            elif draw < 0.55:
                clock.hold()
            elif draw < 0.98:
                clock.resume()
            elif rng.random() < 0.3:
                clock.stop()
        clock.advance()
        rows.append((clock.s, clock.rate, clock.rate1, clock.rate2))
        relaxed.append(clock.relaxed)
        if clock.arrived or (clock.stopping and clock.at_rest):
            break
    return np.array(rows), np.array(relaxed)


def check(move: Move, states: np.ndarray, relaxed: np.ndarray, period: float) -> None:
    s, rate, rate1, rate2 = states.T[:, :, np.newaxis]
    q, *by_s = move.path.sample(states[:, 0])
    motion = derivatives(*by_s, rate, rate1, rate2)
    limits = np.where(relaxed[:, np.newaxis, np.newaxis], move.stops, move.moves)
    for k, quantity in enumerate(motion):
        assert (np.abs(quantity) <= limits[:, k] * (1.0 + ROUNDING)).all()
    assert (np.diff(s, axis=0) >= 0.0).all()
    assert rate.min() >= 0.0
    assert rate.max() <= 1.0 + ROUNDING
    for k in (1, 2, 3):  # what drives see; a difference spans k ticks, and the graver limits of any of them
        spans = np.lib.stride_tricks.sliding_window_view(limits[:, k - 1], k + 1, axis=0).max(axis=-1)
        noise = 2.0**k * 4e-16 * np.abs(q).max() / period**k
        assert (np.abs(np.diff(q, k, axis=0)) / period**k <= spans * (1.0 + 1e-4) + noise).all()


@pytest.mark.parametrize("seed", range(SCRIPTS))
def test_any_commands_at_any_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    period = float(rng.choice([0.001, 0.002, 0.004]))
    drawn = move(rng)
    states, relaxed = script(drawn.clock(period), rng, 1500)
    check(drawn, states, relaxed, period)


def test_stops_are_nearly_the_best_possible() -> None:
    """In the time of the slowest axis alone, or a little more; within the limits all the way."""
    rng, period, ratios = np.random.default_rng(4), 0.002, []
    for _ in range(25):
        drawn = move(rng)
        for s in rng.uniform(0.0, drawn.path.duration, 2).tolist():
            clock = drawn.clock(period, s)
            _, v, a, _ = drawn.path.evaluate(s)
            best = max(alone(*axis) for axis in zip(v, a, *drawn.stops[1:], strict=True))
            clock.stop()
            states, relaxed = script(clock, rng, 3000)
            assert clock.at_rest
            check(drawn, states, relaxed, period)
            ratios.append(len(states) * period / (best + 4 * period))
    assert np.median(ratios) < 1.10
    assert np.percentile(ratios, 90) < 1.25
