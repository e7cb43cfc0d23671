"""Accuracy of F and its inverses over limits of eight and of eighteen decades, judged in extended precision.

Distances are from 1e-12 to 1e12 times the distance at which a branch changes, times from 1 + 1e-16 to 1e12 times f.
"""

from collections.abc import Callable

import numpy as np
import pytest

from axisync_motion import (
    Profile,
    duration,
    lowest_acceleration,
    lowest_jerk,
    lowest_velocity,
    max_distance,
    synchronise_batch,
    time_optimal,
)

COUNT = 2500
TOLERANCE = 1e-14
PULSES = ["constant", "parabolic"]
MAPS = {"v": lowest_velocity, "a": lowest_acceleration, "j": lowest_jerk}
Cases = dict[str, np.ndarray]

both_ranges = pytest.mark.parametrize("decades", [8, 18])
both_pulses = pytest.mark.parametrize("pulse", PULSES)
all_maps = pytest.mark.parametrize("name", MAPS)


def draw(decades: int, seed: int, count: int = COUNT) -> Cases:
    rng = np.random.default_rng(seed)
    v, a, j = 10.0 ** rng.uniform(-decades / 2, decades / 2, (3, count))
    reached = np.minimum(a, np.sqrt(v * j))
    border = np.where(rng.random(count) < 0.5, v * v / reached + reached * v / j, 2 * reached**3 / j**2)
    near = rng.random(count) < 0.6
    scale = 10.0 ** np.where(near, rng.uniform(-0.3, 0.3, count), rng.uniform(-12, 12, count))
    return {"d": border * scale * rng.choice([-1.0, 1.0], count), "v": v, "a": a, "j": j}


def short_pulses(seed: int, count: int = 2000) -> Cases:
    """Ramps that are 10 to 1e12 times as long as their jerk pulses: just above f, here the roots cancel."""
    rng = np.random.default_rng(seed)
    v, a = 10.0 ** rng.uniform(-3, 3, (2, count))
    j = a * a / v * 10.0 ** rng.uniform(1, 12, count)
    d = (v * v / a + a * v / j) * 10.0 ** rng.uniform(-4, 0.3, count)
    return {"d": d, "v": v, "a": a, "j": j}


def stretch(seed: int, count: int = COUNT) -> np.ndarray:
    rng = np.random.default_rng(seed + 1)
    kinds = [(1, -16.0, -8.0), (1, -8.0, 0.0), (0, 0.0, 1.0), (0, 0.0, 12.0)]
    factors = [one + 10.0 ** rng.uniform(low, high, count) for one, low, high in kinds]
    return np.choose(rng.integers(0, 4, count), factors)


def each(cases: Cases, function: Callable[..., object], *first: np.ndarray, **options: str) -> list:
    columns = [x.tolist() for x in (*first, cases["d"], cases["v"], cases["a"], cases["j"])]
    return [function(*row, **options) for row in zip(*columns, strict=True)]


def check(profiles: list[Profile], cases: Cases, t: np.ndarray, pulse: str) -> None:
    """Integrate T and U in extended precision: duration, distance, limits; no negative segment."""
    extended = np.longdouble
    assert np.finfo(extended).eps < 1e-18, "this test needs a longer float than float64"
    series = np.array([p.T for p in profiles]).astype(extended)
    inputs = np.array([p.U for p in profiles]).astype(extended)
    assert (series >= 0).all()
    assert np.isfinite(inputs.astype(float)).all()
    mean = inputs if pulse == "constant" else inputs * 2 / 3
    s = v = a = np.zeros(len(profiles), dtype=extended)
    peak_v = peak_a = s
    for k in range(7):
        dt, j = series[:, k], mean[:, k]
        # A symmetric pulse moves its own middle as far as its mean does; its skew cancels over the move.
        s, v, a = s + dt * (v + dt / 2 * (a + dt / 3 * j)), v + dt * (a + dt / 2 * j), a + dt * j
        peak_v, peak_a = np.maximum(peak_v, np.abs(v)), np.maximum(peak_a, np.abs(a))
    d = np.asarray(cases["d"], dtype=extended)
    assert np.abs(s / d - 1).max() < TOLERANCE
    assert np.abs(series.sum(axis=1) / t - 1).max() < 1e-15
    assert np.abs(np.array([p.duration for p in profiles]) / t - 1).max() == 0.0
    assert np.abs(v / peak_v).max() < TOLERANCE
    assert np.abs(a / peak_a).max() < TOLERANCE
    if pulse == "constant":
        assert (np.abs(inputs).max(axis=1) <= cases["j"]).all()
    for peak, limit in ((peak_v, "v"), (peak_a, "a"), (np.abs(inputs).max(axis=1), "j")):
        assert (peak / cases[limit] - 1).max() < 1e-15


@both_ranges
@both_pulses
def test_time_optimal(decades: int, pulse: str) -> None:
    cases = draw(decades, 1)
    t = np.array(each(cases, duration, pulse=pulse))
    check(each(cases, time_optimal, pulse=pulse), cases, t, pulse)


@both_ranges
@both_pulses
def test_max_distance_inverts_duration(decades: int, pulse: str) -> None:
    cases = draw(decades, 2)
    t = each(cases, duration, pulse=pulse)
    limits = zip(t, *(cases[k].tolist() for k in "vaj"), strict=True)
    d = np.array([max_distance(*row, pulse=pulse) for row in limits])
    assert np.abs(d / np.abs(cases["d"]) - 1).max() < TOLERANCE


@both_ranges
@both_pulses
@all_maps
def test_inverse_maps(name: str, decades: int, pulse: str) -> None:
    cases = draw(decades, 3)
    t = np.array(each(cases, duration, pulse=pulse)) * stretch(3)
    profiles = each(cases, MAPS[name], t, pulse=pulse)
    check(profiles, cases, t, pulse)


@both_pulses
@all_maps
def test_inverse_maps_where_roots_cancel(name: str, pulse: str) -> None:
    cases = short_pulses(10)
    t = np.nextafter(each(cases, duration, pulse=pulse), np.inf)
    check(each(cases, MAPS[name], t, pulse=pulse), cases, t, pulse)


@pytest.mark.usefixtures("each_backend")
@pytest.mark.parametrize("minimise", ["velocity", "acceleration", "jerk"])
def test_batch_where_roots_cancel(minimise: str) -> None:
    """The same on arrays: one axis, its limits those of every case, so one batch a case."""
    cases = short_pulses(11, 300)
    for d, v, a, j in zip(*(cases[k].tolist() for k in "dvaj"), strict=True):
        t = float(np.nextafter(duration(d, v, a, j), np.inf))
        series, inputs, times = synchronise_batch([[d]], [v], [a], [j], minimise, duration=t)
        shape = Profile(tuple(series[0, 0]), tuple(inputs[0, 0]), float(times[0]), d)
        check([shape], {"d": d, "v": v, "a": a, "j": j}, np.array([t]), "constant")


@both_ranges
@both_pulses
@all_maps
def test_reduced_limit_gives_back_the_time(name: str, decades: int, pulse: str) -> None:
    """What makes it an inverse, (35): f with the reduced limit in place of the given one is t."""
    cases = draw(decades, 4)
    t = np.array(each(cases, duration, pulse=pulse)) * stretch(4)
    profiles = each(cases, MAPS[name], t, pulse=pulse)
    reduced = {
        "v": [abs(p.peak_velocity) for p in profiles],
        "a": [abs(p.peak_acceleration) for p in profiles],
        "j": [abs(p.U[0]) for p in profiles],
    }[name]
    usable = np.array(reduced) > 1e-39
    assert usable.mean() > 0.9
    limited = {key: x[usable] for key, x in (cases | {name: np.array(reduced)}).items()}
    back = np.array(each(limited, duration, pulse=pulse))
    assert np.abs(back / t[usable] - 1).max() < TOLERANCE


@both_ranges
@all_maps
def test_at_the_shortest_time_the_optimum_is_kept(name: str, decades: int) -> None:
    cases = draw(decades, 5, 500)
    optimal = each(cases, time_optimal)
    t = np.array([p.duration for p in optimal])
    assert each(cases, MAPS[name], t) == optimal
    assert each(cases, MAPS[name], t * (1 - 9e-13)) == optimal


@both_ranges
@pytest.mark.parametrize("limit", ["v", "a", "j"])
def test_monotone_in_every_limit(limit: str, decades: int) -> None:
    """More of any limit never takes longer, for steps from 1e-15 to a factor of 10."""
    cases = draw(decades, 6)
    rng = np.random.default_rng(7)
    more = cases | {limit: cases[limit] * (1.0 + 10.0 ** rng.uniform(-15, 1, COUNT))}
    before, after = (np.array(each(c, duration)) for c in (cases, more))
    assert (after / before - 1).max() <= 1e-15
    assert (after < before).mean() > 0.1


@both_ranges
def test_monotone_in_the_distance(decades: int) -> None:
    cases = draw(decades, 8)
    rng = np.random.default_rng(9)
    farther = cases | {"d": cases["d"] * (1.0 + 10.0 ** rng.uniform(-14, 1, COUNT))}
    before, after = (np.array(each(c, duration)) for c in (cases, farther))
    assert (after / before - 1).min() >= -1e-15
