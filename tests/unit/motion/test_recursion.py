"""The recursion of (10) and (12) against exact sampling."""

import numpy as np
import pytest

from axisync_motion import recursion, sample_count, time_optimal


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("distance", [100.0, -25.0, 10.0])
@pytest.mark.parametrize("period", [0.002, 0.37, 5.0])
def test_follows_the_curve_and_ends_on_the_target(pulse: str, distance: float, period: float) -> None:
    profile = time_optimal(distance, 20.0, 20.0, 30.0, pulse=pulse)
    states = list(recursion(profile, period))
    assert len(states) == np.ceil(profile.duration / period)
    assert states[-1] == (distance, 0.0, 0.0, 0.0)
    for k, state in enumerate(states[:-1], start=1):
        assert state[:3] == pytest.approx(profile.sample(k * period)[:3], abs=1e-11)


def test_jerk_of_the_recursion() -> None:
    profile = time_optimal(100.0, 20.0, 20.0, 30.0, pulse="parabolic")
    for k, state in enumerate(list(recursion(profile, 0.01))[:-1], start=1):
        assert state[3] == pytest.approx(profile.sample(k * 0.01)[3], abs=1e-10)


def test_whole_number_of_periods_has_no_extra_sample() -> None:
    """5.25 s of 2 ms are 2,625 samples although the quotient rounds to a little more or less."""
    assert sample_count(5.25, 0.002) == 2625
    assert sample_count(0.3, 0.1) == 3  # 2.9999999999999996 in floating point, and
    assert sample_count(0.6 + 1e-16, 0.2) == 3
    assert 2.1 / 0.7 > 3.0
    assert sample_count(2.1, 0.7) == 3
    assert sample_count(5.2501, 0.002) == 2626
    assert sample_count(0.0, 0.002) == 0


def test_nothing_to_move_gives_no_samples() -> None:
    assert list(recursion(time_optimal(0.0, 1.0, 1.0, 1.0), 0.002)) == []


@pytest.mark.parametrize("period", [0.0, -0.1, float("nan"), float("inf")])
def test_invalid_period(period: float) -> None:
    with pytest.raises(ValueError, match="period"):
        list(recursion(time_optimal(1.0, 1.0, 1.0, 1.0), period))
