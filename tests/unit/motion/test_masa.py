"""MASA on the paper's arm, ties, requested durations, and refusals."""

import math
import pickle

import numpy as np
import pytest

from axisync_motion import InfeasibleDuration, InvalidLimits, lowest_jerk, synchronise, time_optimal

pytestmark = pytest.mark.usefixtures("each_backend")

START = np.array([0.0, -150.0, 60.0, -45.0, -45.0, 45.0])
TARGET = np.array([100.0, -90.0, -60.0, -120.0, 45.0, 45.0])
DISTANCES = TARGET - START
V, A, J = np.full(6, 30.0), np.full(6, 40.0), np.full(6, 80.0)
MINIMISE = ["velocity", "acceleration", "jerk"]


@pytest.mark.parametrize("minimise", MINIMISE)
def test_kingkong_times(minimise: str) -> None:
    """Section V.B.1: duration and per-axis minimum times; joint 3 moves farthest and sets the pace."""
    move = synchronise(DISTANCES, V, A, J, minimise)
    assert move.duration == pytest.approx(5.25, rel=1e-12)
    assert move.minimum_durations == pytest.approx([55 / 12, 3.25, 5.25, 3.75, 4.25, 0.0], rel=1e-14)
    assert move.limiting == 2
    assert move.T.shape == move.U.shape == (6, 7)
    assert [math.fsum(row) for row in move.T] == pytest.approx([5.25] * 6, rel=1e-15)


def test_kingkong_jerks() -> None:
    """The peak jerks of f_J^-1 for this move."""
    move = synchronise(DISTANCES, V, A, J, "jerk")
    assert np.abs(move.U[:, 0]) == pytest.approx([32.665, 13.269, 80.0, 16.586, 23.704, 0.0], abs=5e-4)
    assert np.sign(move.U[:, 0]) == pytest.approx(np.sign(DISTANCES))


@pytest.mark.parametrize("minimise", MINIMISE)
def test_critical_axis_keeps_its_optimum(minimise: str) -> None:
    move = synchronise(DISTANCES, V, A, J, minimise)
    fastest = time_optimal(DISTANCES[2], 30.0, 40.0, 80.0)
    assert move.axis(2) == fastest
    assert move.T[2] == pytest.approx(fastest.T, rel=0)


@pytest.mark.parametrize("minimise", MINIMISE)
def test_ties_are_all_critical(minimise: str) -> None:
    move = synchronise([50.0, -50.0, 50.0], [30.0] * 3, [40.0] * 3, [80.0] * 3, minimise)
    assert (move.T[0] == move.T).all()
    assert move.U[0, 0] == move.U[2, 0] == -move.U[1, 0] == 80.0
    assert move.limiting == 0


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("minimise", MINIMISE)
def test_requested_duration(minimise: str, pulse: str) -> None:
    move = synchronise(DISTANCES, V, A, J, minimise, duration=8.0, pulse=pulse)
    assert move.duration == 8.0
    assert [math.fsum(row) for row in move.T] == pytest.approx([8.0] * 6, rel=1e-15)
    assert move.sample(8.0)[0] == pytest.approx(DISTANCES, rel=0)
    third = move.axis(2)
    peaks = {"velocity": third.peak_velocity, "acceleration": third.peak_acceleration, "jerk": third.U[0]}
    limits = {"velocity": 30.0, "acceleration": 40.0, "jerk": 80.0}
    assert all(abs(peaks[name]) <= limits[name] * (1 + 1e-15) for name in limits)
    assert abs(peaks[minimise]) < 0.9 * limits[minimise]


def test_what_is_minimised_is_lowest() -> None:
    """Each map's own quantity is the smallest of the three on every axis that has time to spare."""
    moves = {m: synchronise(DISTANCES, V, A, J, m) for m in MINIMISE}
    for index in (0, 1, 3, 4):
        peaks = {
            m: (abs(p.peak_velocity), abs(p.peak_acceleration), abs(p.U[0]))
            for m, p in ((m, move.axis(index)) for m, move in moves.items())
        }
        for column, own in enumerate(MINIMISE):
            assert all(peaks[own][column] <= peaks[other][column] * (1 + 1e-14) for other in MINIMISE)
        assert peaks["jerk"][2] < 0.5 * peaks["acceleration"][2]


def test_duration_below_by_rounding_is_the_shortest() -> None:
    assert synchronise(DISTANCES, V, A, J, duration=5.25 * (1 - 5e-13)).duration == 5.25


def test_too_short_names_axis_and_shortest() -> None:
    with pytest.raises(InfeasibleDuration, match=r"axis 2: duration = 5\.0: shortest possible is 5\.25") as caught:
        synchronise(DISTANCES, V, A, J, duration=5.0)
    assert (caught.value.axis, caught.value.value, caught.value.shortest) == (2, 5.0, 5.25)
    assert caught.value.bound == 5.25
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_too_short_for_one_axis() -> None:
    with pytest.raises(InfeasibleDuration) as caught:
        lowest_jerk(5.0, 120.0, 30.0, 40.0, 80.0)
    assert (caught.value.axis, caught.value.shortest) == (None, 5.25)


def test_nothing_to_move() -> None:
    still = synchronise([0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
    assert still.duration == 0.0
    assert not still.T.any()
    assert not still.U.any()
    position, *rest = still.sample([0.0, 1.0])
    assert not position.any()
    assert not any(x.any() for x in rest)


def test_nothing_to_move_in_some_time() -> None:
    """(85) for several axes: T of each map, no jerk."""
    expected = {"velocity": [0, 0, 0, 2, 0, 0, 0], "acceleration": [0, 1, 0, 0, 0, 1, 0], "jerk": [0.5, 0] * 3 + [0.5]}
    for minimise, series in expected.items():
        move = synchronise([0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0], minimise, duration=2.0)
        assert move.T.tolist() == [series, series]
        assert not move.U.any()


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, 1e41, 1e-41])
@pytest.mark.parametrize("name", ["v_max", "a_max", "j_max"])
def test_invalid_limit_names_axis_value_and_bound(name: str, bad: float) -> None:
    limits = {key: [1.0, 1.0, 1.0] for key in ("v_max", "a_max", "j_max")}
    limits[name][1] = bad
    with pytest.raises(InvalidLimits, match=f"axis 1: {name} = ") as caught:
        synchronise([1.0, 1.0, 1.0], **limits)
    assert (caught.value.axis, caught.value.name) == (1, name)
    assert caught.value.value == pytest.approx(bad, nan_ok=True)
    assert "finite" in caught.value.bound
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e61, 1e-61])
def test_invalid_distance(bad: float) -> None:
    with pytest.raises(InvalidLimits, match="axis 0: distance = "):
        synchronise([bad, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(InvalidLimits, match=r"^distance = "):
        time_optimal(bad, 1.0, 1.0, 1.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0, 1e76])
def test_invalid_duration(bad: float) -> None:
    with pytest.raises(InvalidLimits, match="duration = "):
        synchronise([1.0], [1.0], [1.0], [1.0], duration=bad)
    with pytest.raises(InvalidLimits, match="duration = "):
        lowest_jerk(bad, 1.0, 1.0, 1.0, 1.0)


def test_vectors_of_any_kind() -> None:
    """Lists of floats are fastest; whatever else holds numbers gives the same."""
    plain = synchronise(DISTANCES.tolist(), V.tolist(), A.tolist(), J.tolist())
    for kind in (tuple, np.array, lambda x: [int(y) for y in x], lambda x: list(map(np.float64, x))):
        other = synchronise(*(kind(x.tolist()) for x in (DISTANCES, V, A, J)))
        assert (other.T == plain.T).all()
        assert (other.U == plain.U).all()
        assert (other.distances == DISTANCES).all()


def test_wrong_shapes() -> None:
    with pytest.raises(ValueError, match="a_max: expected 2 values"):
        synchronise([1.0, 1.0], [1.0, 1.0], [1.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="distances: expected a vector"):
        synchronise(np.ones((2, 2)), [1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="at least one axis"):
        synchronise([], [], [], [])


def test_unknown_choices() -> None:
    with pytest.raises(ValueError, match="minimise = 'time'"):
        synchronise([1.0], [1.0], [1.0], [1.0], "time")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="pulse = 'sine'"):
        synchronise([1.0], [1.0], [1.0], [1.0], pulse="sine")  # type: ignore[arg-type]
