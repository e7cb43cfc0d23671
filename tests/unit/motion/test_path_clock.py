"""The path clock: exact time while running, the closed form of a stop, the chain rule."""

import numpy as np
import pytest

from axisync_motion import PathClock, derivatives

DT = 0.002


def run(clock: PathClock, ticks: int, dt: float = DT) -> PathClock:
    for _ in range(ticks):
        clock.advance(dt)
    return clock


def test_running_is_a_product_not_a_sum() -> None:
    clock = run(PathClock(), 100_000)
    assert clock.s == 100_000 * DT
    assert (clock.rate, clock.rate1, clock.rate2) == (1.0, 0.0, 0.0)
    assert not clock.at_rest
    assert not clock.stopping
    assert sum([DT] * 100_000) != 100_000 * DT  # or this test would prove nothing


def test_skipped_ticks_count() -> None:
    one, other = run(PathClock(), 7), PathClock()
    other.advance(DT, 3)
    other.advance(DT, 4)
    assert one.s == other.s == 7 * DT


def test_change_of_the_period() -> None:
    clock = run(run(PathClock(), 10), 5, 0.001)
    assert clock.s == pytest.approx(0.025, rel=1e-15)
    clock.stop(0.5)
    run(run(clock, 50), 100, 0.001)
    other = PathClock(0.025)
    other.stop(0.5)
    run(other, 100)
    assert clock.s == pytest.approx(other.s, rel=1e-14)
    assert clock.rate == pytest.approx(other.rate, rel=1e-12)


def test_stop_follows_the_curve() -> None:
    clock = run(PathClock(), 500)
    begin, duration = clock.s, 0.8
    clock.stop(duration)
    assert clock.stopping
    assert clock.s == begin
    assert clock.rate == 1.0
    assert clock.rate2 == pytest.approx(-6.0 / duration**2)
    for k in range(1, 400):
        clock.advance(DT)
        x = k * DT / duration
        assert clock.s == pytest.approx(begin + duration * (x - x**3 + x**4 / 2), rel=1e-14)
        assert clock.rate == pytest.approx(1 - 3 * x**2 + 2 * x**3, abs=1e-14)
        assert clock.rate1 == pytest.approx((-6 * x + 6 * x**2) / duration, abs=1e-13)
        assert clock.rate2 == pytest.approx((-6 + 12 * x) / duration**2, abs=1e-12)
        assert not clock.at_rest
    clock.advance(DT)
    assert clock.at_rest
    assert clock.s == begin + duration / 2
    assert (clock.rate, clock.rate1, clock.rate2) == (0.0, 0.0, 0.0)


def test_rest_is_for_good() -> None:
    clock = run(PathClock(), 100)
    clock.stop(0.1)
    run(clock, 60)
    s = clock.s
    clock.stop(5.0)
    run(clock, 1000)
    assert clock.at_rest
    assert clock.s == s


def test_second_stop_changes_nothing() -> None:
    one, other = run(PathClock(), 100), run(PathClock(), 100)
    for clock in (one, other):
        clock.stop(0.7)
        run(clock, 30)
    other.stop(0.01)
    run(one, 30), run(other, 30)
    assert (one.s, one.rate, one.rate1, one.rate2) == (other.s, other.rate, other.rate1, other.rate2)


def test_stop_before_the_first_tick_and_at_once() -> None:
    clock = PathClock()
    clock.stop(0.0)
    assert clock.at_rest
    assert clock.s == 0.0
    clock.advance(DT)
    assert clock.s == 0.0


def test_derivatives_are_those_of_the_composition() -> None:
    """q(s(t)) for q = s^3 - s, s = s0 + D (x - x^3 + x^4/2), against polynomial arithmetic."""
    duration, begin = 0.9, 0.4
    t = np.polynomial.Polynomial([0.0, 1.0])
    x = t / duration
    path = begin + duration * (x - x**3 + x**4 / 2)
    composed = path**3 - path
    for now in (0.0, 0.3, 0.77):
        s, rate = path(now), path.deriv()
        got = derivatives(
            np.array([3 * s**2 - 1]), np.array([6 * s]), np.array([6.0]),
            rate(now), rate.deriv()(now), rate.deriv(2)(now),
        )  # fmt: skip
        expected = [composed.deriv(k)(now) for k in (1, 2, 3)]
        assert [float(x[0]) for x in got] == pytest.approx(expected, rel=1e-12)


def test_derivatives_at_rate_one_are_the_paths_own() -> None:
    q1, q2, q3 = np.array([0.1, -3.0]), np.array([1e-9, 7.0]), np.array([0.3, -2.0])
    for got, own in zip(derivatives(q1, q2, q3, 1.0, 0.0, 0.0), (q1, q2, q3), strict=True):
        assert (got == own).all()
