"""What is refused, what is still, and that tables and landings do what their docstrings say."""

import numpy as np
import pytest

from axisync_motion import InvalidLimits, from_profiles, rate_tables, synchronise
from axisync_motion.rate_interval import moment, nearest, of_acceleration, of_jerk
from axisync_motion.rate_landing import landing, ticks_to_land
from axisync_motion.rate_tables import LEVELS, STEEPEST, UNIT, Table

V, A, J = np.full(6, 0.5236), np.full(6, 0.6981), np.full(6, 1.3963)
PATH = from_profiles(np.zeros(6), synchronise([1.8, 1.0, -2.1, -1.3, 1.5, 0.3], V, A, J))


def test_limits_that_leave_no_room() -> None:
    cases = (
        ("a_stop", (V, A, J, A, 3 * J)),
        ("j_stop", (V, A, J, 1.5 * A, J)),
        ("v_max", (0.9 * V, A, J, 2 * A, 3 * J)),
    )
    for name, limits in cases:
        with pytest.raises(InvalidLimits, match=f"axis [0-5]: {name} = .* above the path's own") as caught:
            rate_tables(PATH, *limits)
        assert caught.value.name == name
    with pytest.raises(ValueError, match="a_stop: expected 6"):
        rate_tables(PATH, V, A, J, A[:3], 3 * J)


def test_nothing_to_move() -> None:
    still = from_profiles(np.zeros(6), synchronise(np.zeros(6), V, A, J))
    assert not rate_tables(still, V, A, J, 1.5 * A, 3 * J).codes.any()


def test_more_jerk_stops_sooner() -> None:
    one, other = (
        rate_tables(PATH, V, A, J, 1.5 * A, factor * J, cells=300).codes[0].astype(float) for factor in (2.5, 4.0)
    )
    assert (other >= one).mean() > 0.99
    assert np.median(other / np.maximum(one, 1.0)) > 1.1


def test_table_is_linear_between_its_points() -> None:
    codes = np.arange((LEVELS + 1) * 5, dtype=np.uint16).reshape(LEVELS + 1, 5)
    table = Table(codes, 0.5, 2.0, 1e9)
    assert table.at(0.5, 0.25) == 0.5 * 0.5 * codes[LEVELS // 2, 1]
    assert table.at(0.75, 1.0) == pytest.approx(0.5 * (codes[-1, 1] + codes[-1, 2]) / 2)
    assert table.at(9.0, 1.0) == 0.5 * codes[-1, 4]
    assert Table(codes, 0.5, 2.0, 3.0).at(9.0, 1.0) == 3.0
    assert (UNIT * 65535 == STEEPEST).all()


@pytest.mark.parametrize("n", [2, 3, 7, 10])
def test_a_landing_lands(n: int) -> None:
    dt, excess, w = 0.002, 3e-4, -0.05
    curve = landing(excess, w, n, dt)
    rate, slope = excess, w
    for k in range(n):
        u = curve.first + k * curve.step
        rate, slope = rate + dt * (slope + dt * u / 2), slope + dt * u
    assert rate == pytest.approx(0.0, abs=1e-15)
    assert slope == pytest.approx(0.0, abs=1e-13)


def test_no_landing_away_from_the_target_or_beyond_what_is_allowed() -> None:
    assert ticks_to_land(1e-4, 0.05, -1e9, 1e9, 0.002) is None
    assert ticks_to_land(0.5, -0.05, -1e9, 1e9, 0.002) is None
    assert ticks_to_land(1e-4, -0.05, -1.0, 1.0, 0.002) is None
    assert ticks_to_land(1e-4, -0.05, -30.0, 30.0, 0.002) is not None


def test_intervals_touch_the_limits() -> None:
    """With u at either end, one axis is at its limit, up to the square of what the guess was wrong by."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        q1, q2, q3 = rng.uniform(-0.5, 0.5, (3, 4))
        a, j = rng.uniform(0.6, 1.0, (2, 4))
        q, r, w, tau, guess = (q1, q1, q2, q3), 0.7, -0.1, 0.002, 0.3
        last = moment(r, w, guess, tau)
        intervals = (of_acceleration(q, last, list(a)), a, 2), (of_jerk(q, last, list(j)), j, 3)
        for interval, limits, order in intervals:
            for u in interval:
                at = moment(r, w, u, tau)
                jerk = q3 * at.rate**3 + 3 * q2 * at.rate * at.rate1 + q1 * u
                acceleration = q2 * at.rate**2 + q1 * at.rate1
                share = np.abs((acceleration if order == 2 else jerk) / limits).max()
                assert share == pytest.approx(1.0, abs=2e-5 + 1e-6 * u * u)


def test_nearest() -> None:
    assert nearest((0.0, 3.0), (1.0, 9.0)) == (1.0, 3.0)
    assert nearest((0.0, 3.0), (4.0, 9.0)) == (3.0, 3.0)
    assert nearest((0.0, 3.0), (-4.0, -2.0)) == (0.0, 0.0)
