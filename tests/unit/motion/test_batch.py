"""Many moves at once give what one at a time gives."""

import numpy as np
import pytest

from axisync_motion import InfeasibleDuration, InvalidLimits, synchronise, synchronise_batch

pytestmark = pytest.mark.usefixtures("each_backend")

V, A, J = np.array([30.0, 2.0, 5.0]), np.array([40.0, 900.0, 3.0]), np.array([80.0, 70.0, 1e3])
MINIMISE = ["velocity", "acceleration", "jerk"]


def distances(count: int) -> np.ndarray:
    rng = np.random.default_rng(5)
    d = rng.choice([-1.0, 1.0], (count, 3)) * 10.0 ** rng.uniform(-6, 4, (count, 3))
    d[rng.random((count, 3)) < 0.2] = 0.0
    d[0] = 0.0
    return d


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("minimise", MINIMISE)
@pytest.mark.parametrize("extra", [None, 3.0])
def test_equals_single_moves(minimise: str, pulse: str, extra: float | None) -> None:
    d = distances(200)
    shortest = synchronise_batch(d, V, A, J, pulse=pulse)[2]
    wanted = None if extra is None else shortest + extra
    series, inputs, times = synchronise_batch(d, V, A, J, minimise, duration=wanted, pulse=pulse)
    assert series.shape == inputs.shape == (200, 3, 7)
    for k, row in enumerate(d):
        one = synchronise(row, V, A, J, minimise, None if wanted is None else wanted[k], pulse)
        assert times[k] == pytest.approx(one.duration, rel=1e-15, abs=0)
        assert series[k] == pytest.approx(one.T, rel=1e-13, abs=1e-14 * one.duration)
        assert inputs[k] == pytest.approx(one.U, rel=1e-13, abs=0)


@pytest.mark.parametrize("minimise", MINIMISE)
def test_shortest_duration_asked_for(minimise: str) -> None:
    """The maps are flat there, so distances and times are compared, not digits of T."""
    d = distances(500)
    shortest = synchronise_batch(d, V, A, J)[2]
    series, inputs, times = synchronise_batch(d, V, A, J, minimise, duration=shortest)
    assert (times == shortest).all()
    assert series.sum(axis=2) == pytest.approx(np.repeat(times[:, np.newaxis], 3, axis=1), rel=1e-14)
    tj, ta, tv = series[:, :, 0], series[:, :, 1], series[:, :, 3]
    assert inputs[:, :, 0] * tj * (tj + ta) * (2 * tj + ta + tv) == pytest.approx(d, rel=1e-14)


def test_duration_below_by_rounding_is_the_shortest() -> None:
    d = distances(20)
    shortest = synchronise_batch(d, V, A, J)[2]
    assert (synchronise_batch(d, V, A, J, duration=shortest * (1 - 5e-13))[2] == shortest).all()


def test_more_moves_than_one_chunk() -> None:
    d = np.tile(distances(500), (12, 1))
    series, inputs, times = synchronise_batch(d, V, A, J)
    for result in (series, inputs, times):
        assert (result.reshape(12, 500, -1) == result[:500].reshape(500, -1)).all()


def test_one_duration_for_all() -> None:
    d = distances(10)[:5] % 1.0
    assert (synchronise_batch(d, V, A, J, duration=50.0)[2] == 50.0).all()


def test_arrays_of_any_layout() -> None:
    """Read-only, strided and transposed arrays, and no arrays at all."""
    d = distances(9)
    frozen = np.asfortranarray(d)
    frozen.flags.writeable = False
    wanted = np.linspace(3e4, 4e4, 18)[::2]
    limits = np.repeat(np.array([V, A, J]), 2, axis=1)[:, ::2]
    plain = synchronise_batch(d, V, A, J, duration=wanted.copy())
    for other in (
        synchronise_batch(frozen, *limits, duration=wanted),
        synchronise_batch(d.tolist(), V.tolist(), A.tolist(), J.tolist(), duration=wanted.tolist()),
    ):
        assert all((one == two).all() for one, two in zip(plain, other, strict=True))
    assert (limits == [V, A, J]).all()


def test_no_moves() -> None:
    series, inputs, times = synchronise_batch(np.zeros((0, 3)), V, A, J)
    assert series.shape == inputs.shape == (0, 3, 7)
    assert times.shape == (0,)


def test_refusals_name_the_axis() -> None:
    d = distances(20)
    with pytest.raises(InfeasibleDuration) as short:
        synchronise_batch([[1.0, 0.0, 400.0]], V, A, J, duration=[1.0])
    assert short.value.axis == 2
    with pytest.raises(InvalidLimits, match=r"axis 1: a_max = -1\.0"):
        synchronise_batch(d, V, [1.0, -1.0, 1.0], J)
    d[3, 2] = np.nan
    with pytest.raises(InvalidLimits, match="axis 2: distance = nan"):
        synchronise_batch(d, V, A, J)
    with pytest.raises(InvalidLimits, match="duration = nan"):
        synchronise_batch(distances(2), V, A, J, duration=float("nan"))


def test_wrong_shapes() -> None:
    with pytest.raises(ValueError, match="distances: expected shape"):
        synchronise_batch([1.0, 2.0, 3.0], V, A, J)
    with pytest.raises(ValueError, match="j_max: expected shape"):
        synchronise_batch(distances(10), V, A, [1.0])
    with pytest.raises(ValueError, match="duration: expected one or 10"):
        synchronise_batch(distances(10), V, A, J, duration=[1.0, 2.0])
    with pytest.raises(ValueError, match="minimise"):
        synchronise_batch(distances(10), V, A, J, "time")  # type: ignore[arg-type]
