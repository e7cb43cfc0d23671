"""Properties of trajectories made from any synchronised move."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_motion import (
    Evaluator,
    Trajectory,
    concatenate,
    from_profiles,
    synchronise,
)
from axisync_motion.path_bounds import cell_bounds

short = settings(derandomize=True, deadline=None, max_examples=100)
EPS = float(np.finfo(np.float64).eps)


def log_uniform(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda x: 10.0**x)


@st.composite
def moves(draw: st.DrawFn, decades: float = 4.0, max_axes: int = 12) -> dict:
    """Targets, limits and the trajectory of a move; positions between -10 and 10."""
    count = draw(st.integers(1, max_axes))
    limits = np.array([[draw(log_uniform(-decades / 2, decades / 2)) for _ in range(3)] for _ in range(count)])
    start = np.array([draw(st.floats(-10.0, 10.0)) for _ in range(count)])
    size = np.array([draw(st.one_of(st.just(0.0), log_uniform(-9, 1))) for _ in range(count)])
    target = np.clip(start + size * np.array([draw(st.sampled_from([-1, 1])) for _ in range(count)]), -10, 10)
    minimise = draw(st.sampled_from(["velocity", "acceleration", "jerk"]))
    pulse = draw(st.sampled_from(["constant", "parabolic"]))
    # A distance so small that it is no number of the planner's is no move.
    target = np.where(np.abs(target - start) > 1e-60, target, start)
    profile = synchronise(target - start, *limits.T, minimise, pulse=pulse)
    path = from_profiles(start, profile, target)
    return {"path": path, "profile": profile, "start": start, "target": target, "limits": limits.T}


@short
@given(moves())
def test_segments_meet_and_end_on_target(move: dict) -> None:
    path: Trajectory = move["path"]
    v, a, _ = move["limits"]
    assert path.knots[0] == 0.0
    assert path.duration == move["profile"].duration
    assert (np.diff(path.knots) > 0.0).all()
    assert np.isfinite(path.coefficients).all()
    if path.duration == 0.0:
        return
    resolution = 8.0 * EPS * path.duration  # knots closer than this are one
    width = np.diff(path.knots)[:, np.newaxis]
    powers = np.arange(path.coefficients.shape[1])
    ends = (path.coefficients * width[:, :, np.newaxis] ** powers[:, np.newaxis]).sum(axis=1)
    nexts = np.concatenate([path.coefficients[1:, 0], path.end[np.newaxis]])
    scale = np.abs(move["start"]) + np.abs(move["target"]) + np.abs(move["profile"].distances)
    assert (np.abs(ends - nexts) <= 4 * EPS * scale + v * resolution).all()
    weights = powers[1:, np.newaxis] * width[:, :, np.newaxis] ** (powers[1:, np.newaxis] - 1)
    speeds = (path.coefficients[:, 1:] * weights).sum(axis=1)
    next_speeds = np.concatenate([path.coefficients[1:, 1], np.zeros((1, v.size))])
    assert (np.abs(speeds - next_speeds) <= 2e-14 * v + a * resolution).all()
    assert (path.coefficients[0, 0] == move["start"]).all()


@short
@given(moves(), st.lists(st.floats(-0.1, 1.1), min_size=1, max_size=20))
def test_follows_the_profile_within_limits_with_the_same_bits(move: dict, shares: list[float]) -> None:
    path: Trajectory = move["path"]
    s = np.array([*(x * path.duration for x in shares), *path.knots])
    many = path.sample(s)
    profile = move["profile"].sample(s)
    scale = np.abs(move["start"]) + np.abs(move["target"])
    v, a, j = move["limits"]
    resolution = 8.0 * EPS * path.duration
    assert (np.abs(many[0] - profile[0] - move["start"]) <= 8 * EPS * scale + 2 * v * resolution).all()
    assert (np.abs(many[1]) <= v * (1 + 1e-14) + a * resolution).all()
    assert (np.abs(many[2]) <= a * (1 + 1e-14) + j * resolution).all()
    tj = np.where(move["profile"].T[:, 0] > 0, move["profile"].T[:, 0], 1.0)
    assert (np.abs(many[3]) <= j * (1 + 1e-14 + 4.0 * resolution / tj)).all()
    evaluator = Evaluator(path)
    for i, x in enumerate(s.tolist()):
        assert np.array(evaluator.at(x)).tobytes() == np.array([m[i] for m in many]).tobytes()


@short
@given(moves(max_axes=3), moves(max_axes=3), st.floats(0.0, 5.0))
def test_concatenation_keeps_both(one: dict, other: dict, rest: float) -> None:
    n = min(one["start"].size, other["start"].size)
    first = from_profiles(one["start"][:n], synchronise(one["profile"].distances[:n], *one["limits"][:, :n]))
    distances = other["profile"].distances[:n]
    second = from_profiles(first.end, synchronise(distances, *other["limits"][:, :n]))
    both = concatenate([first, second], [rest])
    assert (np.diff(both.knots) > 0.0).all()
    assert both.duration == pytest.approx(first.duration + rest + second.duration, rel=1e-14)
    assert (both.end == second.end).all()
    shares = np.linspace(0.01, 0.99, 23)
    offset = first.duration + rest
    v = np.maximum(one["limits"][0, :n], other["limits"][0, :n])
    allowed = 8 * EPS * (np.abs(first.start) + np.abs(second.end) + 20.0 + v * both.duration)
    assert (np.abs(both.sample(shares * first.duration)[0] - first.sample(shares * first.duration)[0]) <= allowed).all()
    late = both.sample(offset + shares * second.duration)[0]
    assert (np.abs(late - second.sample(shares * second.duration)[0]) <= allowed).all()


@pytest.mark.usefixtures("each_backend")
@short
@given(moves(max_axes=4), st.integers(1, 60))
def test_bounds_bound(move: dict, cells: int) -> None:
    """No sample of any cell is above its bound, and the bounds are near the limits."""
    path: Trajectory = move["path"]
    if path.duration == 0.0:
        return
    bounds = cell_bounds(path, cells)[:-1]
    scale = np.array(move["limits"]) * (1 + 1e-6)
    n = path.start.size
    edges = np.linspace(0.0, path.duration, cells + 1)
    for cell in range(cells):
        samples = np.array(path.sample(np.linspace(edges[cell], edges[cell + 1], 23, endpoint=False))[1:])
        assert (samples.max(axis=1) <= bounds[cell, :, :n] + 1e-9 * scale).all()
        assert (-samples.min(axis=1) <= bounds[cell, :, n:] + 1e-9 * scale).all()
    assert (bounds <= 2.0 * np.concatenate([scale, scale], axis=1)).all()
