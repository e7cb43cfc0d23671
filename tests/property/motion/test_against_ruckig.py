"""Durations against an independent planner: the Ruckig library, 10,000 six-axis moves."""

import numpy as np
import pytest

from axisync_motion import synchronise, synchronise_batch

ruckig = pytest.importorskip("ruckig")


def ruckig_moves(distances: np.ndarray, v: np.ndarray, a: np.ndarray, j: np.ndarray) -> np.ndarray:
    """[m, 1 + n]: duration and each axis's own shortest time; NaN for a move that it refuses."""
    n = v.size
    planner, trajectory = ruckig.Ruckig(n), ruckig.Trajectory(n)
    query = ruckig.InputParameter(n)
    query.max_velocity, query.max_acceleration, query.max_jerk = v.tolist(), a.tolist(), j.tolist()
    out = np.full((len(distances), 1 + n), np.nan)
    for k, target in enumerate(distances.tolist()):
        query.target_position = target
        if planner.calculate(query, trajectory) in (ruckig.Result.Working, ruckig.Result.Finished):
            out[k] = [trajectory.duration, *trajectory.independent_min_durations]
    return out


@pytest.mark.parametrize("seed", range(10))
def test_durations_are_equal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    v, a, j = 10.0 ** rng.uniform(-1, 1, (3, 6))
    d = rng.choice([-1.0, 1.0], (1000, 6)) * 10.0 ** rng.uniform(-4, 2, (1000, 6))
    theirs = ruckig_moves(d, v, a, j)
    accepted = ~np.isnan(theirs[:, 0])
    assert accepted.mean() > 0.9
    ours = synchronise_batch(d, v, a, j)[2]
    assert ours[accepted] == pytest.approx(theirs[accepted, 0], rel=1e-14, abs=0)
    for k in np.flatnonzero(accepted)[:50]:
        assert synchronise(d[k], v, a, j).minimum_durations == pytest.approx(theirs[k, 1:], rel=1e-14, abs=0)


def test_lowest_velocity_is_their_time_synchronisation() -> None:
    """Rest to rest, Ruckig's synchronised axes have the peak velocity of f_V^-1."""
    rng = np.random.default_rng(3)
    v, a, j = np.full(3, 30.0), np.full(3, 40.0), np.full(3, 80.0)
    planner, trajectory, query = ruckig.Ruckig(3), ruckig.Trajectory(3), ruckig.InputParameter(3)
    query.max_velocity, query.max_acceleration, query.max_jerk = v.tolist(), a.tolist(), j.tolist()
    for d in rng.uniform(-120.0, 120.0, (50, 3)):
        query.target_position = d.tolist()
        planner.calculate(query, trajectory)
        ours = synchronise(d, v, a, j, "velocity")
        t = np.linspace(0.0, ours.duration, 60)
        theirs = np.array([trajectory.at_time(x)[0] for x in t.tolist()])
        assert ours.sample(t)[0] == pytest.approx(theirs, abs=1e-7)
