"""The compiled backend gives what the plain one gives, digit for digit but the last few."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from axisync_motion import from_profiles, rate_tables, synchronise, synchronise_batch, use_backend
from axisync_motion.path_bounds import cell_bounds

ULPS = 4
MINIMISE = ["velocity", "acceleration", "jerk"]

both_ranges = pytest.mark.parametrize("decades", [8, 18])
both_pulses = pytest.mark.parametrize("pulse", ["constant", "parabolic"])
all_maps = pytest.mark.parametrize("minimise", MINIMISE)


@pytest.fixture(autouse=True)
def _numba() -> Iterator[None]:
    pytest.importorskip("numba")
    yield
    use_backend("auto")


def on_both(function: Callable[[], list[np.ndarray]]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    use_backend("python")
    plain = function()
    use_backend("numba")
    return zip(plain, function(), strict=True)


def within_ulps(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((np.abs(one - other) <= ULPS * np.spacing(np.abs(one))).all())


def draw(decades: int, count: int, axes: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Limits [count, 3, axes] and distances [count, axes], some 0, around those at which branches change."""
    rng = np.random.default_rng(decades)
    limits = 10.0 ** rng.uniform(-decades / 2, decades / 2, (count, 3, axes))
    v, a, j = limits.transpose(1, 0, 2)
    reached = np.minimum(a, np.sqrt(v * j))
    signs = rng.choice([-1.0, 0.0, 1.0], v.shape, p=[0.45, 0.1, 0.45])
    near = rng.random(v.shape) < 0.6
    scale = 10.0 ** np.where(near, rng.uniform(-0.3, 0.3, v.shape), rng.uniform(-12, 12, v.shape))
    return limits, (v * v / reached + reached * v / j) * scale * signs


@both_ranges
@both_pulses
@all_maps
def test_single_moves(minimise: str, pulse: str, decades: int) -> None:
    limits, distances = draw(decades, 400)
    stretch = 10.0 ** np.random.default_rng(1).uniform(-6, 2, len(limits))

    def plan() -> list[np.ndarray]:
        moves = []
        for rows, d, more in zip(limits, distances, stretch.tolist(), strict=True):
            shortest = synchronise(d, *rows, minimise, pulse=pulse)
            longer = synchronise(d.tolist(), *rows.tolist(), minimise, shortest.duration * (1.0 + more), pulse)
            moves += [shortest, longer]
        results = [(m.T, m.U, m.minimum_durations, m.distances, np.array([m.duration, m.limiting])) for m in moves]
        return [np.array(part) for part in zip(*results, strict=True)]

    for plain, compiled in on_both(plan):
        assert within_ulps(plain, compiled)


@both_pulses
@all_maps
def test_batches_give_the_bits_of_single_moves_when_compiled(minimise: str, pulse: str) -> None:
    limits, distances = draw(8, 2000)
    d, rows = distances[:, :4] * 1e-3, limits[0][:, :4]
    use_backend("numba")
    series, inputs, times = synchronise_batch(d, *rows, minimise, pulse=pulse)
    for k in range(0, len(d), 40):
        one = synchronise(d[k], *rows, minimise, pulse=pulse)
        assert one.duration == times[k]
        assert (series[k] == one.T).all()
        assert (inputs[k] == one.U).all()


@both_pulses
@all_maps
def test_bounds(minimise: str, pulse: str) -> None:
    rng = np.random.default_rng(7)
    v, a, j = 10.0 ** rng.uniform(-0.5, 0.5, (3, 12))
    start, target = rng.uniform(-2.0, 2.0, (2, 12))
    path = from_profiles(start, synchronise(target - start, v, a, j, minimise, pulse=pulse), target)
    ((cells, cells_too),) = on_both(lambda: [cell_bounds(path, 150)])
    assert cells_too == pytest.approx(cells, rel=1e-12, abs=1e-13)


@both_pulses
@all_maps
def test_rate_tables(minimise: str, pulse: str) -> None:
    """To a code: they are rounded down, so the last digit of a value may decide."""
    rng = np.random.default_rng(8)
    v, a, j = 10.0 ** rng.uniform(-0.5, 0.5, (3, 7))
    for still in (0, 3):
        distances = np.where(np.arange(7) < still, 0.0, rng.uniform(-2.0, 2.0, 7))
        path = from_profiles(np.zeros(7), synchronise(distances, v, a, j, minimise, pulse=pulse))
        ((plain, compiled),) = on_both(lambda path=path: [rate_tables(path, v, a, j, 1.5 * a, 3.0 * j).codes])
        apart = np.abs(plain.astype(np.int64) - compiled)
        assert apart.max() <= 1
        assert (apart > 0).mean() < 0.01
        assert plain.any()
