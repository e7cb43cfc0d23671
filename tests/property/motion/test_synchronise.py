"""Properties of whole moves, looked for by hypothesis."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_motion import InfeasibleDuration, InvalidLimits, SyncProfile, synchronise, synchronise_batch

# Reproducible everywhere; time limits would make the result depend on the machine.
short = settings(derandomize=True, deadline=None, max_examples=150)


def log_uniform(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda x: 10.0**x)


limits = st.tuples(log_uniform(-4, 4), log_uniform(-4, 4), log_uniform(-4, 4))
distances = st.one_of(
    st.just(0.0),
    st.tuples(st.sampled_from([-1.0, 1.0]), log_uniform(-20, 12)).map(math.prod),
    st.sampled_from([1.0, -1.0, 5e-17, 2.0**-52]),
)

pytestmark = pytest.mark.usefixtures("each_backend")
axes = st.lists(st.tuples(distances, limits), min_size=1, max_size=8)
minimises = st.sampled_from(["velocity", "acceleration", "jerk"])
pulses = st.sampled_from(["constant", "parabolic"])
stretches = st.one_of(st.none(), st.just(1.0), st.floats(1.0, 10.0), log_uniform(0, 6))


def split(move: list) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    d = np.array([distance for distance, _ in move])
    v, a, j = np.array([limit for _, limit in move]).T
    return d, v, a, j


def plan(move: list, minimise: str, pulse: str, stretch: float | None) -> SyncProfile:
    parts = split(move)
    shortest = synchronise(*parts, minimise, pulse=pulse)
    if stretch is None:
        return shortest
    return synchronise(*parts, minimise, duration=shortest.duration * stretch, pulse=pulse)


@short
@given(axes, minimises, pulses, stretches)
def test_arrives_together_on_target_within_limits(move: list, minimise: str, pulse: str, stretch: float | None) -> None:
    d, v, a, j = split(move)
    result = plan(move, minimise, pulse, stretch)
    assert np.isfinite(result.T).all()
    assert np.isfinite(result.U).all()
    assert (result.T >= 0.0).all()
    for row in result.T.tolist():
        assert math.fsum(row) == pytest.approx(result.duration, rel=1e-15, abs=0)
    mean = np.abs(result.U[:, 0]).astype(np.longdouble) * (1 if pulse == "constant" else np.longdouble(2) / 3)
    tj, ta, tv = (result.T[:, k].astype(np.longdouble) for k in (0, 1, 3))
    assert (mean * tj <= a * (1 + 1e-15)).all()
    assert (mean * tj * (tj + ta) <= v * (1 + 1e-15)).all()
    assert (np.abs(result.U) <= j[:, np.newaxis] * (1 + 1e-15)).all()
    moved = np.sign(result.U[:, 0]) * mean * tj * (tj + ta) * (2 * tj + ta + tv)
    assert (np.abs(moved - d) <= 1e-14 * np.abs(d)).all()


@short
@given(axes, minimises, pulses, stretches, st.lists(st.floats(-0.1, 1.1), min_size=1, max_size=20))
def test_samples_are_within_limits_and_between_the_ends(
    move: list, minimise: str, pulse: str, stretch: float | None, times: list[float]
) -> None:
    d, v, a, j = split(move)
    result = plan(move, minimise, pulse, stretch)
    s, vs, as_, js = result.sample(np.array(times) * result.duration)
    assert (np.abs(vs) <= v * (1 + 2e-15)).all()
    assert (np.abs(as_) <= a * (1 + 2e-15)).all()
    assert (np.abs(js) <= j * (1 + 2e-15)).all()
    assert (s * np.sign(d) >= -1e-15 * np.abs(d)).all()
    assert (np.abs(s) <= np.abs(d) * (1 + 1e-15)).all()
    assert (vs * np.sign(d) >= -1e-13 * v).all()
    ends = result.sample(np.array([-1e-9, 0.0, 1.0, 2.0]) * max(result.duration, 1.0))
    assert (ends[0][0] == 0.0).all()
    assert (ends[0][3] == d).all()
    assert not ends[1][[0, 3]].any()
    assert not ends[2][[0, 3]].any()
    assert not ends[3][[0, 3]].any()


@short
@given(axes, minimises, pulses)
def test_no_axis_could_make_it_faster(move: list, minimise: str, pulse: str) -> None:
    """The duration is the slowest axis's own, and that axis is critical."""
    d, v, a, j = split(move)
    result = plan(move, minimise, pulse, None)
    alone = [synchronise(*(x[[i]] for x in (d, v, a, j)), pulse=pulse).duration for i in range(d.size)]
    assert result.minimum_durations.tolist() == alone
    assert result.duration == max(alone) == alone[result.limiting]


@short
@given(axes, minimises, pulses)
def test_batch_agrees(move: list, minimise: str, pulse: str) -> None:
    d, v, a, j = split(move)
    one = synchronise(d, v, a, j, minimise, pulse=pulse)
    series, inputs, times = synchronise_batch(d[np.newaxis], v, a, j, minimise, pulse=pulse)
    assert times[0] == pytest.approx(one.duration, rel=1e-15, abs=0)
    assert series[0].sum(axis=1) == pytest.approx(one.duration, rel=1e-14, abs=0)
    tj, ta, tv = series[0, :, 0], series[0, :, 1], series[0, :, 3]
    mean = inputs[0, :, 0] * (1.0 if pulse == "constant" else 2.0 / 3.0)
    assert mean * tj * (tj + ta) * (2 * tj + ta + tv) == pytest.approx(d, rel=1e-14, abs=0)


@short
@given(st.lists(st.floats(), min_size=3, max_size=3), st.lists(st.floats(), min_size=9, max_size=9), st.floats())
def test_any_floats_plan_or_are_refused(d: list[float], limit: list[float], duration: float) -> None:
    """Whatever the bits, the answer is a finite plan or one of the two errors (both ValueError)."""
    try:
        result = synchronise(d, limit[:3], limit[3:6], limit[6:], duration=duration)
    except (InvalidLimits, InfeasibleDuration):
        return
    assert np.isfinite(result.T).all()
    assert np.isfinite(result.U).all()
    assert math.isfinite(result.duration)


@short
@given(axes, st.integers(0, 7), st.sampled_from(["v_max", "a_max", "j_max"]), st.sampled_from([0.0, -1.0, math.nan]))
def test_bad_limits_are_named(move: list, index: int, name: str, bad: float) -> None:
    d, *three = split(move)
    index %= d.size
    values = dict(zip(("v_max", "a_max", "j_max"), three, strict=True))
    values[name][index] = bad
    with pytest.raises(InvalidLimits) as caught:
        synchronise(d, **values)
    assert (caught.value.axis, caught.value.name) == (index, name)


@pytest.mark.parametrize("minimise", ["velocity", "acceleration", "jerk"])
def test_axes_of_very_different_size(minimise: str) -> None:
    """Distances of 1e9:1 and more on one move: every axis keeps its limits and arrives."""
    d = np.array([1e9, 1.0, -1e-9, 1e-15, 5e-17])
    result = synchronise(d, np.ones(5), np.ones(5), np.ones(5), minimise)
    tj, ta, tv = result.T[:, 0], result.T[:, 1], result.T[:, 3]
    assert result.U[:, 0] * tj * (tj + ta) * (2 * tj + ta + tv) == pytest.approx(d, rel=1e-14, abs=0)
    assert (result.sample(result.duration)[0] == d).all()
