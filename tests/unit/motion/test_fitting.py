"""Functions of time as trajectories: polynomials reproduced, kinks refused, tolerances kept, short segments too."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_motion import from_profiles, synchronise
from axisync_motion.fitting import NotSmooth, fit, stretched
from axisync_motion.trajectory import Trajectory

Array = NDArray[np.float64]
POSITION, JERK = [1e-9], [1e-3]


def ramp(duration: float) -> Trajectory:
    """One scalar that is the time."""
    coefficients = np.array([[[0.0], [1.0], [0.0], [0.0]]])
    return Trajectory(np.array([0.0, duration]), coefficients, np.zeros(1), np.array([duration]))


def slope_of(gradient: Callable[[float], float]) -> Callable[[float, Array], Array]:
    return lambda time, _: np.array([[gradient(time)]])


def fitted(function: Callable[[Array], Array], duration: float, n: int = 1) -> Trajectory:
    return fit(
        function, ramp(duration), lambda *_: np.zeros((n, 1)), POSITION * n, JERK * n, function(np.zeros(1))[0]
    )  # fmt: skip


def one(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    return lambda times: np.asarray(function(times), dtype=np.float64)[:, np.newaxis]


def test_a_polynomial_is_reproduced() -> None:
    c = np.array([0.3, -1.0, 0.5, 2.0, -0.7, 0.1])
    result = fitted(one(lambda t: np.polyval(c[::-1], t)), 1.5)
    times = np.linspace(0.0, 1.5 - 1e-12, 777)
    for order, (values, bound) in enumerate(zip(result.sample(times), (1e-14, 1e-11, 1e-8, 1e-5), strict=True)):
        exact = np.polyval(np.polyder(c[::-1], order) if order else c[::-1], times)
        assert np.abs(values[:, 0] - exact).max() < bound


def test_start_and_end_are_the_functions_to_the_bit() -> None:
    function = one(lambda t: np.sin(3.0 * t) + 0.1)
    result = fitted(function, 0.7)
    assert result.start[0] == result.evaluate(0.0)[0][0] == function(np.zeros(1))[0, 0]
    assert result.end[0] == function(np.array([0.7]))[0, 0]


@pytest.mark.parametrize("rate", [1.0, 10.0, 60.0])
def test_tolerances_are_kept(rate: float) -> None:
    result = fitted(one(lambda t: np.sin(rate * t)), 1.0)
    times = np.linspace(0.0, 1.0 - 1e-12, 5000)
    q, _, _, j = result.sample(times)
    assert np.abs(q[:, 0] - np.sin(rate * times)).max() < 1e-9
    assert np.abs(j[:, 0] + rate**3 * np.cos(rate * times)).max() < 1e-5 * rate**3 + 1e-2


def test_more_is_cut_where_more_bends() -> None:
    gentle, sharp = (fitted(one(lambda t, w=w: np.tanh((t - 0.5) / w)), 1.0) for w in (1.0, 0.02))
    assert len(sharp.knots) > 2 * len(gentle.knots)
    assert np.diff(sharp.knots)[0] > 4.0 * np.diff(sharp.knots).min()


@pytest.mark.parametrize("function", [lambda t: np.abs(t - 0.31), lambda t: np.where(t < 0.31, 0.0, 1.0)])
def test_kinks_and_jumps_are_no_motion(function: Callable[[Array], Array]) -> None:
    smooth = np.linspace(0.0, 1.0, 2)
    with pytest.raises(NotSmooth) as caught:
        fit(
            lambda t: np.stack([0.5 * t, function(t)], axis=-1), ramp(smooth[-1]), lambda *_: np.zeros((2, 1)),
            [1e-9, 1e-9], [1e-3, 1e-3], [0.0, float(function(np.zeros(1))[0])],
        )  # fmt: skip
    assert caught.value.axis == 1
    assert caught.value.time == pytest.approx(0.31, abs=0.12)


def test_a_kink_on_a_knot_is_none() -> None:
    knots, coefficients = np.array([0.0, 0.31, 1.0]), np.zeros((2, 4, 1))
    coefficients[:, 1], coefficients[1, 0] = 1.0, 0.31
    scalars = Trajectory(knots, coefficients, np.zeros(1), np.ones(1))
    result = fit(one(lambda t: np.abs(t - 0.31)), scalars, slope_of(lambda _: 1.0), POSITION, JERK, [0.31])
    assert result.sample([0.2, 0.31, 0.9])[0][:, 0] == pytest.approx([0.11, 0.0, 0.59], abs=1e-15)


def arm_like(x: Array) -> Array:
    """[k, 2] smooth in scalars [k, 2]."""
    return np.stack([np.sin(3.0 * x[:, 0]) + 0.5 * x[:, 1], np.cos(2.0 * x[:, 0] + x[:, 1])], axis=-1)


def arm_slope(x: Array) -> Array:
    a, b = x.tolist()
    return np.array([[3.0 * math.cos(3.0 * a), 0.5], [-2.0 * math.sin(2.0 * a + b), -math.sin(2.0 * a + b)]])


@pytest.mark.parametrize("small", [0.1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-13])
@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
def test_segments_too_short_for_jerk_are_carried_on(small: float, pulse: str) -> None:
    """A second scalar that moves less and less: its pulses end after 1e-2 s ... 1e-13 s."""
    profile = synchronise([0.3, small], [0.5, 0.5], [1.0, 1.0], [5.0, 5.0], pulse=pulse)
    scalars = from_profiles(np.zeros(2), profile)
    limits = np.array([60.0, 60.0])
    result = fit(
        lambda t: arm_like(profile.sample(t)[0]), scalars, lambda t, _: arm_slope(profile.sample(np.array([t]))[0][0]),
        [1e-9, 1e-9], 1e-3 * limits, arm_like(np.zeros((1, 2)))[0],
    )  # fmt: skip
    times = within(result.knots)
    q, *_, j = result.sample(times)
    x, v, a, u = profile.sample(times)
    assert np.abs(q - arm_like(x)).max() < 1e-9
    assert np.abs(j - third(x, v, a, u)).max() < 5e-3 * limits[0]


def within(knots: Array) -> Array:
    """Times inside of pieces: at a knot jerk has two values."""
    return np.sort(np.concatenate([knots[:-1] + share * np.diff(knots) for share in (0.1, 0.3, 0.6, 0.9)]))


def third(x: Array, v: Array, a: Array, u: Array) -> Array:
    """[k, 2] third derivatives of `arm_like` by the chain rule."""
    found = []
    for value, inner, inner_v, inner_a, inner_u in (
        ("sin", 3.0 * x[:, 0], 3.0 * v[:, 0], 3.0 * a[:, 0], 3.0 * u[:, 0]),
        ("cos", 2.0 * x[:, 0] + x[:, 1], 2.0 * v[:, 0] + v[:, 1], 2.0 * a[:, 0] + a[:, 1], 2.0 * u[:, 0] + u[:, 1]),
    ):
        f1, f2, f3 = (
            (np.cos(inner), -np.sin(inner), -np.cos(inner))
            if value == "sin"
            else (-np.sin(inner), -np.cos(inner), np.sin(inner))
        )
        found.append(f1 * inner_u + 3.0 * f2 * inner_v * inner_a + f3 * inner_v**3)
    return np.stack([found[0] + 0.5 * u[:, 1], found[1]], axis=-1)


@pytest.mark.parametrize("distance", [1e-3, 1e-6, 1e-10])
def test_a_motion_that_is_nothing_but_short_segments(distance: float) -> None:
    profile = synchronise([distance], [0.5], [1.0], [5.0])
    scalars = from_profiles(np.zeros(1), profile)
    result = fit(
        one(lambda t: 1.0 + 2.0 * profile.sample(t)[0][:, 0]), scalars, slope_of(lambda _: 2.0), POSITION, JERK, [1.0]
    )  # fmt: skip
    times = within(result.knots)
    _, v, a, j = result.sample(times)
    _, sv, sa, sj = profile.sample(times)
    assert np.abs(v - 2.0 * sv).max() < 1e-3 * np.abs(sv).max()
    assert np.abs(a - 2.0 * sa).max() < 1e-3 * np.abs(sa).max()
    assert np.abs(np.abs(j) - 2.0 * np.abs(sj)).max() < 1e-2 * 10.0


def test_slow_motions_are_cut_no_finer_than_needed() -> None:
    result = fitted(one(lambda t: np.sin(t / 1e4)), 1e5)
    assert len(result.knots) < 600
    times = np.linspace(0.0, 1e5, 1000)
    assert np.abs(result.sample(times)[0][:, 0] - np.sin(times / 1e4)).max() < 1e-9


@pytest.mark.parametrize("factor", [1.0, 1.5, 7.0, 1e4])
def test_stretched_is_the_same_curve(factor: float) -> None:
    function = one(lambda t: np.sin(5.0 * t))
    fast = fitted(function, 1.0)
    slow = stretched(fast, factor)
    assert (slow.start, slow.end, slow.duration) == (fast.start, fast.end, fast.duration * factor)
    times = np.linspace(0.0, 1.0, 333, endpoint=False)
    for power, (here, there) in enumerate(zip(slow.sample(times * factor), fast.sample(times), strict=True)):
        assert here * factor**power == pytest.approx(there, rel=1e-9, abs=1e-9)
