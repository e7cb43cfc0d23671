"""An override keeps the limits of moves, never only those of stops; and what the shares of the tables are for."""

import sys

import numpy as np
import pytest

from axisync_motion import PathClock, from_profiles, rate_tables, synchronise

TABLES = sys.modules["axisync_motion.rate_tables"]
LIMITS = np.radians([[30.0], [40.0], [80.0]]) * np.ones((1, 6))
STOPS = np.radians([[60.0], [240.0]]) * np.ones((1, 6))
PERIOD, TICKS = 0.002, 1500
HARD = (4, 23, 112, 170)
"""Seeds with which tables that promise nearly all that is possible promise too much."""


def relaxed_ticks(seed: int) -> int:
    """Of a move of the demo's arm whose override is changed at random; every jerk is within its limit meanwhile."""
    rng = np.random.default_rng(seed)
    distances = rng.uniform(-1.0, 1.0, 6) * rng.choice([0.2, 1.0, 3.0])
    minimise = str(rng.choice(["acceleration", "velocity", "jerk"]))
    pulse = str(rng.choice(["constant", "constant", "parabolic"]))
    path = from_profiles(np.zeros(6), synchronise(distances, *LIMITS, minimise, pulse=pulse))  # type: ignore[arg-type]
    clock = PathClock(path, rate_tables(path, *LIMITS, *STOPS), PERIOD)
    every, relaxed = int(rng.choice([3, 30, 300])), 0
    for tick in range(TICKS):
        if tick % every == 0:
            clock.set_override(float(rng.choice([0.0, 0.3, 1.0, rng.random()])))
        clock.advance()
        relaxed += clock.relaxed
        if not clock.relaxed:
            assert (np.abs(clock.motion()[3]) <= LIMITS[2] * (1.0 + 1e-6)).all()
        if clock.arrived:
            break
    return relaxed


@pytest.mark.parametrize("seed", [*range(3), *HARD])
def test_overrides_keep_the_limits_of_moves(seed: int) -> None:
    assert relaxed_ticks(seed) == 0


def test_with_nearly_all_that_is_possible_they_would_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TABLES, "SHARE_U", np.full((3, 1), 0.96))
    monkeypatch.setattr(TABLES, "SHARE_J", np.full((3, 1), 0.99))
    assert all(relaxed_ticks(seed) > 0 for seed in HARD)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(200))
def test_many_more(seed: int) -> None:
    assert relaxed_ticks(seed) == 0
