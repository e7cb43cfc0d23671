"""Stops from anywhere on a path keep the stop limits, also between the points of the table."""

import numpy as np
import pytest

from axisync_motion import (
    InvalidLimits,
    PathClock,
    StopTable,
    Trajectory,
    concatenate,
    derivatives,
    from_profiles,
    stop_table,
    synchronise,
)

V, A, J = np.full(6, 0.5236), np.full(6, 0.6981), np.full(6, 1.3963)
START = np.array([0.0, -2.6, 1.05, -0.78, -0.78, 0.79])
TARGET = np.array([1.8, -1.57, -1.05, -2.09, 0.78, 0.79])


def move(minimise: str = "acceleration", pulse: str = "constant") -> Trajectory:
    return from_profiles(START, synchronise(TARGET - START, V, A, J, minimise, pulse=pulse), TARGET)


def there_and_back() -> Trajectory:
    back = from_profiles(TARGET, synchronise(START - TARGET, V, A, J, "jerk"), START)
    return concatenate([move(), back], [0.3])


def worst_share(
    trajectory: Trajectory, s0: float, duration: float, a: np.ndarray, j: np.ndarray
) -> tuple[float, float]:
    """Largest acceleration and jerk of a stop over their limits, at 400 instants."""
    x = np.linspace(0.0, 1.0, 400)
    s = s0 + duration * (x - x**3 + x**4 / 2)
    r, r1, r2 = 1 - 3 * x**2 + 2 * x**3, (-6 * x + 6 * x**2) / duration, (-6 + 12 * x) / duration**2
    _, q1, q2, q3 = trajectory.sample(s)
    _, acceleration, jerk = derivatives(q1, q2, q3, r[:, None], r1[:, None], r2[:, None])
    return float((np.abs(acceleration) / a).max()), float((np.abs(jerk) / j).max())


def starts(table: StopTable) -> np.ndarray:
    """The first, the last and two inner points of every cell."""
    cells = [table.s[:-1] + f * np.diff(table.s) for f in (0.0, 0.31, 0.77)]
    return np.concatenate([*cells, np.nextafter(table.s[1:], 0.0)])


@pytest.mark.usefixtures("each_backend")
@pytest.mark.parametrize("factors", [(1.2, 2.0), (1.5, 3.0)])
@pytest.mark.parametrize("path", [move("velocity"), move("jerk"), move(pulse="parabolic"), there_and_back()])
def test_stops_keep_the_limits(path: Trajectory, factors: tuple[float, float]) -> None:
    a, j = factors[0] * A, factors[1] * J
    table = stop_table(path, V, a, j)
    shares = np.array([worst_share(path, s, table.at(s), a, j) for s in starts(table)[::2].tolist()])
    assert shares.max() <= 1.0
    # Not by being slow: most stops use most of what they may.
    assert np.median(shares.max(axis=1)) > 0.8


@pytest.mark.usefixtures("each_backend")
def test_few_points_are_slower_but_safe() -> None:
    path, a, j = move(), 1.5 * A, 3 * J
    coarse, fine = stop_table(path, V, a, j, points=12), stop_table(path, V, a, j, points=400)
    assert coarse.s.size == 13
    assert max(worst_share(path, s, coarse.at(s), a, j)[0] for s in starts(coarse).tolist()) <= 1.0
    assert max(worst_share(path, s, coarse.at(s), a, j)[1] for s in starts(coarse).tolist()) <= 1.0
    s = np.linspace(0.0, path.duration, 500)
    assert np.mean([coarse.at(x) for x in s]) > np.mean([fine.at(x) for x in s])


@pytest.mark.usefixtures("each_backend")
def test_shorter_by_a_tenth_would_not_do() -> None:
    """The bounds are tight enough to matter: somewhere on the path there is little to spare."""
    path, a, j = move(), 1.5 * A, 3 * J
    table = stop_table(path, V, a, j)
    assert max(max(worst_share(path, s, 0.9 * table.at(s), a, j)) for s in table.s[:-1].tolist()) > 1.05


def test_clock_through_a_stop() -> None:
    """What the cycle does, tick by tick, against finite differences of the positions it sends."""
    path, a, j, dt = move(), 1.5 * A, 3 * J, 0.002
    table = stop_table(path, V, a, j)
    for begin in range(0, 2600, 331):
        clock, positions = PathClock(), []
        for tick in range(4000):
            if tick == begin:
                clock.stop(table.at(clock.s))
            positions.append(path.evaluate(clock.s)[0])
            clock.advance(dt)
        q = np.array(positions)
        assert clock.at_rest
        assert (np.abs(np.diff(q, axis=0)) <= V * dt * (1 + 1e-9)).all()
        assert (np.abs(np.diff(q, 2, axis=0)) <= a * dt**2 * (1 + 1e-6)).all()
        assert (np.abs(np.diff(q, 3, axis=0)) <= j * dt**3 * (1 + 1e-4)).all()


@pytest.mark.usefixtures("each_backend")
def test_table_covers_every_s() -> None:
    path = move()
    table = stop_table(path, V, 1.5 * A, 3 * J)
    assert table.s[0] == 0.0
    assert table.s[-1] == path.duration
    assert table.at(-1.0) == table.stop_duration[0]
    assert table.at(1e9) == 0.0
    for i, s in enumerate(table.s.tolist()):
        assert table.at(s) == table.stop_duration[i]
    assert (table.stop_duration[:-1] > 0.0).all()
    assert np.isfinite(table.stop_duration).all()


def test_nothing_to_move() -> None:
    still = from_profiles(START, synchronise(np.zeros(6), V, A, J), START)
    assert stop_table(still, V, A, J).at(0.0) == 0.0


@pytest.mark.usefixtures("each_backend")
def test_limits_that_leave_no_room() -> None:
    for limits, name in (((V, A, 3 * J), "a_stop"), ((V, 1.5 * A, J), "j_stop"), ((0.9 * V, 2 * A, 3 * J), "v_max")):
        with pytest.raises(InvalidLimits, match=f"axis [0-5]: {name} = .* above the path's own") as caught:
            stop_table(move(), *limits)
        assert caught.value.name == name
    with pytest.raises(ValueError, match="a_stop: expected 6"):
        stop_table(move(), V, A[:3], J)


@pytest.mark.usefixtures("each_backend")
def test_arrays_of_any_layout() -> None:
    """Read-only, strided and reversed arrays, and plans read from shared memory."""
    path = move()
    wide = np.repeat(np.array([V, 1.5 * A, 3 * J]), 2, axis=1)[:, ::2]
    parts = [np.frombuffer(p.tobytes()).reshape(p.shape) for p in (path.knots, path.coefficients, path.start, path.end)]
    plain = stop_table(path, V, 1.5 * A, 3 * J)
    other = stop_table(Trajectory(*parts), *wide)
    assert (other.stop_duration == plain.stop_duration).all()
