"""The path clock: exact time while running, stops, holds and overrides within the limits, and what commands mean."""

import math

import numpy as np
import pytest

from axisync_motion import PathClock, RateTables, Trajectory, derivatives, from_profiles, rate_tables, synchronise
from support.stops import alone

DT = 0.002
V, A, J = np.full(6, 0.5236), np.full(6, 0.6981), np.full(6, 1.3963)
A_STOP, J_STOP = 1.5 * A, 3.0 * J


@pytest.fixture(scope="module")
def path() -> Trajectory:
    return from_profiles(np.zeros(6), synchronise([1.8, 1.0, -2.1, -1.3, 1.5, 0.3], V, A, J))


@pytest.fixture(scope="module")
def tables(path: Trajectory) -> RateTables:
    return rate_tables(path, V, A, J, A_STOP, J_STOP)


def run(clock: PathClock, ticks: int) -> PathClock:
    for _ in range(ticks):
        clock.advance()
    return clock


def ticks_to_rest(clock: PathClock) -> int:
    for tick in range(20_000):
        if clock.at_rest:
            return tick
        clock.advance()
    raise AssertionError("never comes to rest")


def test_running_is_a_product_not_a_sum(path: Trajectory, tables: RateTables) -> None:
    clock = run(PathClock(path, tables, DT), 2500)
    assert clock.s == 2500 * DT
    assert (clock.rate, clock.rate1, clock.rate2) == (1.0, 0.0, 0.0)
    assert sum([DT] * 2500) != 2500 * DT  # or this test would prove nothing
    for got, own in zip(clock.motion(), path.evaluate(clock.s), strict=True):
        assert (got == own).all()


def test_arrives_on_target(path: Trajectory, tables: RateTables) -> None:
    clock = PathClock(path, tables, DT)
    assert ticks_to_rest(clock) == math.ceil(path.duration / DT)
    assert clock.arrived
    assert (clock.motion()[0] == path.end).all()


def test_a_stop_from_cruise_takes_as_long_as_the_slowest_axis_alone(path: Trajectory, tables: RateTables) -> None:
    clock = run(PathClock(path, tables, DT), 1250)
    _, v, a, _ = path.evaluate(clock.s)
    best = max(alone(*axis) for axis in zip(v, a, A_STOP, J_STOP, strict=True))
    clock.stop()
    assert ticks_to_rest(clock) * DT < 1.1 * best
    assert (clock.rate, clock.rate1) == (0.0, 0.0)
    assert not clock.arrived


def test_a_stop_is_for_good(path: Trajectory, tables: RateTables) -> None:
    clock = run(PathClock(path, tables, DT), 1000)
    clock.stop()
    run(clock, 1000)
    s = clock.s
    clock.resume()
    clock.set_override(0.5)
    run(clock, 1000)
    assert clock.at_rest
    assert clock.s == s


def test_a_stop_during_a_hold_does_not_begin_anew(path: Trajectory, tables: RateTables) -> None:
    one, other = (run(PathClock(path, tables, DT), 1000) for _ in range(2))
    one.hold()
    other.hold()
    run(one, 50), run(other, 50)
    other.stop()
    run(one, 400), run(other, 400)
    assert (one.s, one.rate) == (other.s, other.rate)
    one.resume(), other.resume()
    run(one, 400), run(other, 400)
    assert one.rate > 0.0
    assert other.rate == 0.0


def test_hold_and_resume_arrive(path: Trajectory, tables: RateTables) -> None:
    clock = run(PathClock(path, tables, DT), 1000)
    clock.hold()
    run(clock, 600)
    assert clock.at_rest
    clock.resume()
    assert not clock.at_rest
    ticks_to_rest(clock)
    assert (clock.motion()[0] == path.end).all()


@pytest.mark.parametrize("after", [1, 30, 100, 200])
def test_resume_while_still_slowing(path: Trajectory, tables: RateTables, after: int) -> None:
    clock = run(PathClock(path, tables, DT), 1000)
    clock.hold()
    rate = run(clock, after).rate
    clock.resume()
    lowest = min(run(clock, 1).rate for _ in range(300))
    assert lowest < rate or after == 1
    assert lowest > 0.0
    ticks_to_rest(clock)
    assert clock.arrived


@pytest.mark.parametrize("rate", [0.03, 0.3, 0.77, 1.0])
def test_override_is_reached_exactly(path: Trajectory, tables: RateTables, rate: float) -> None:
    clock = run(PathClock(path, tables, DT), 1200)
    clock.set_override(rate)
    run(clock, 1000)
    assert clock.rate == rate
    assert (clock.rate1, clock.rate2) == (0.0, 0.0)


def test_override_to_zero_and_back(path: Trajectory, tables: RateTables) -> None:
    clock = run(PathClock(path, tables, DT), 1200)
    clock.set_override(0.0)
    run(clock, 1300)
    assert clock.rate == 0.0
    assert not clock.at_rest  # it waits, as the one who set it knows
    clock.set_override(1.0)
    ticks_to_rest(clock)
    assert clock.arrived


@pytest.mark.parametrize("rate", [-0.1, 1.1, math.nan, math.inf])
def test_override_must_be_a_share(path: Trajectory, tables: RateTables, rate: float) -> None:
    with pytest.raises(ValueError, match=r"override = .*: must be 0 to 1"):
        PathClock(path, tables, DT).set_override(rate)


def test_same_commands_same_bits(path: Trajectory, tables: RateTables) -> None:
    def states() -> list[tuple[float, ...]]:
        clock, seen = PathClock(path, tables, DT), []
        for tick in range(2000):
            if tick % 70 == 0:
                clock.set_override(0.2 + 0.1 * (tick // 70 % 9))
            if tick % 400 == 300:
                clock.hold()
            if tick % 400 == 360:
                clock.resume()
            clock.advance()
            seen.append((clock.s, clock.rate, clock.rate1, clock.rate2))
        return seen

    assert states() == states()


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
