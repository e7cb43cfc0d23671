"""Exact sampling of one axis and of all: ends, symmetry, consistency of the derivatives, both pulses."""

import itertools

import numpy as np
import pytest

from axisync_motion import Profile, lowest_acceleration, synchronise, time_optimal

PULSES = ["constant", "parabolic"]
LIMITS = (20.0, 20.0, 30.0)
DISTANCES = [100.0, 25.0, 10.0, -100.0]  # the three branches of F, and backwards


def profiles() -> list[Profile]:
    made = [time_optimal(d, *LIMITS, pulse=p) for d in DISTANCES for p in PULSES]
    return made + [lowest_acceleration(9.0, 100.0, *LIMITS, pulse=p) for p in PULSES]


@pytest.mark.parametrize("profile", profiles())
def test_ends_are_exact(profile: Profile) -> None:
    for t in (-1.0, -1e-300):
        assert profile.sample(t) == (0.0, 0.0, 0.0, 0.0)
    for t in (profile.duration, profile.duration * (1 + 1e-15), 1e9):
        assert profile.sample(t) == (profile.distance, 0.0, 0.0, 0.0)
    nearly = profile.sample(np.nextafter(profile.duration, 0.0))
    assert nearly[:3] == pytest.approx((profile.distance, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("profile", profiles())
def test_one_time_and_many_agree(profile: Profile) -> None:
    t = np.append(np.linspace(-0.1, profile.duration + 0.1, 198), [0.0, profile.duration])
    together = np.array(profile.sample(t.reshape(20, 10))).reshape(4, -1)
    one_by_one = np.array([profile.sample(x) for x in t.tolist()]).T
    assert (together == one_by_one).all()


@pytest.mark.parametrize("profile", profiles())
def test_is_the_integral_of_its_jerk(profile: Profile) -> None:
    """Eqs. (9)-(10) by Simpson's rule, exact for every polynomial here but the quintic's position."""
    ends = np.cumsum((0.0, *profile.T))
    for low, high in itertools.pairwise(ends):
        if high - low < 1e-12:
            continue
        t = np.linspace(low, high, 65)[1:-1]  # within the segment, where all is smooth
        states = np.array(profile.sample(t))
        step = t[2] - t[0]
        for k in range(3):
            rate = states[k + 1]
            gained = step / 6.0 * (rate[:-2] + 4.0 * rate[1:-1] + rate[2:])
            assert states[k, 2:] - states[k, :-2] == pytest.approx(gained, abs=1e-8 if k == 0 else 2e-12)


@pytest.mark.parametrize("profile", profiles())
def test_symmetric_about_the_middle(profile: Profile) -> None:
    t = np.linspace(0.0, profile.duration / 2, 51)[1:-1]
    one, other = profile.sample(t), profile.sample(profile.duration - t)
    assert one[0] + other[0] == pytest.approx(profile.distance, rel=1e-13)
    assert one[1] == pytest.approx(other[1], rel=1e-12)
    assert one[2] == pytest.approx(-other[2], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("profile", profiles())
def test_limits_are_kept_and_reached(profile: Profile) -> None:
    t = np.linspace(0.0, profile.duration, 4001)
    _, v, a, j = (np.abs(x).max() for x in profile.sample(t))
    assert v <= abs(profile.peak_velocity) * (1 + 1e-15) <= 20.0 * (1 + 2e-15)
    assert a <= abs(profile.peak_acceleration) * (1 + 1e-15) <= 20.0 * (1 + 2e-15)
    assert j <= 30.0 * (1 + 1e-15)
    assert v == pytest.approx(abs(profile.peak_velocity), rel=1e-5)
    assert a == pytest.approx(abs(profile.peak_acceleration), rel=1e-2)
    assert j == pytest.approx(30.0, rel=1e-4)


def test_parabolic_jerk_is_continuous() -> None:
    """Steps of the jerk shrink with the sampling interval; those of the constant pulse do not."""
    steps = {}
    for pulse in PULSES:
        profile = time_optimal(100.0, *LIMITS, pulse=pulse)
        jerk = profile.sample(np.linspace(0.0, profile.duration, 100_001))[3]
        steps[pulse] = np.abs(np.diff(jerk)).max()
    assert steps["constant"] >= 30.0
    assert steps["parabolic"] < 0.02


def test_parabolic_lasts_as_with_two_thirds_of_the_jerk() -> None:
    soft, hard = time_optimal(100.0, *LIMITS, pulse="parabolic"), time_optimal(100.0, 20.0, 20.0, 20.0)
    assert pytest.approx(hard.T, rel=1e-15) == soft.T
    assert soft.U[0] == pytest.approx(30.0, rel=1e-15)


@pytest.mark.parametrize("pulse", PULSES)
def test_synchronised_sampling_is_that_of_each_axis(pulse: str) -> None:
    move = synchronise([100.0, 0.0, -7.0], [20.0] * 3, [20.0] * 3, [30.0] * 3, pulse=pulse)
    t = np.linspace(-0.5, move.duration + 0.5, 60).reshape(3, 4, 5)
    states = move.sample(t)
    assert [x.shape for x in states] == [(3, 4, 5, 3)] * 4
    for index in range(3):
        for together, alone in zip(states, move.axis(index).sample(t), strict=True):
            assert (together[..., index] == alone).all()
    assert [x.shape for x in move.sample(0.1)] == [(3,)] * 4
