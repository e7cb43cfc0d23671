"""Trajectories of synchronised moves and of several in a row."""

import numpy as np
import pytest

from axisync_motion import Evaluator, Trajectory, concatenate, from_profiles, synchronise

START = np.array([0.1, -2.6, 1.05, -0.78, -0.78, 0.7853981633974483])
TARGET = np.array([1.8, -1.57, -1.05, -2.09, 0.78, 0.7853981633974483])
V, A, J = np.full(6, 0.5236), np.full(6, 0.6981), np.full(6, 1.3963)
PULSES = ["constant", "parabolic"]
MINIMISE = ["velocity", "acceleration", "jerk"]


def move(minimise: str = "acceleration", pulse: str = "constant") -> Trajectory:
    return from_profiles(START, synchronise(TARGET - START, V, A, J, minimise, pulse=pulse), TARGET)


@pytest.mark.parametrize("pulse", PULSES)
@pytest.mark.parametrize("minimise", MINIMISE)
def test_equals_the_profiles(minimise: str, pulse: str) -> None:
    profile = synchronise(TARGET - START, V, A, J, minimise, pulse=pulse)
    trajectory = from_profiles(START, profile, TARGET)
    assert trajectory.coefficients.shape[1] == (4 if pulse == "constant" else 6)
    # Not on the knots, where the jerk of the constant pulse steps.
    s = np.setdiff1d(np.linspace(-0.1, profile.duration + 0.1, 3001), trajectory.knots)
    for k, (one, other) in enumerate(zip(trajectory.sample(s), profile.sample(s), strict=True)):
        assert one == pytest.approx(other + (START if k == 0 else 0.0), abs=1e-14 * 10**k)


@pytest.mark.parametrize("pulse", PULSES)
def test_ends_bit_for_bit(pulse: str) -> None:
    trajectory = move(pulse=pulse)
    for s, position in ((-1.0, START), (0.0, START), (trajectory.duration, TARGET), (1e9, TARGET)):
        q, q1, q2, q3 = trajectory.evaluate(s)
        assert (q == position).all()
        assert not q1.any()
        assert not q2.any()
        assert not q3.any() or s == 0.0
    assert trajectory.knots[0] == 0.0
    assert (np.diff(trajectory.knots) > 0.0).all()
    q, q1, q2, _ = trajectory.evaluate(np.nextafter(trajectory.duration, 0.0))
    assert q == pytest.approx(TARGET, abs=5e-16)
    assert q1 == pytest.approx(0.0, abs=1e-14)
    assert q2 == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("pulse", PULSES)
def test_continuous_at_the_knots(pulse: str) -> None:
    """The segments' own polynomials meet: position to rounding, and as many derivatives as the pulse promises."""
    trajectory = move(pulse=pulse)
    widths = np.diff(trajectory.knots)
    for k in range(3 if pulse == "constant" else 4):
        for i in range(widths.size - 1):
            left = derivative(trajectory.coefficients[i], k, widths[i])
            right = derivative(trajectory.coefficients[i + 1], k, 0.0)
            assert left == pytest.approx(right, abs=1e-15 * 20**k)


def derivative(coefficients: np.ndarray, k: int, x: float) -> np.ndarray:
    powers = np.polynomial.polynomial.polyder(coefficients, k)
    return np.polynomial.polynomial.polyval(x, powers)


@pytest.mark.parametrize("pulse", PULSES)
def test_one_and_many_and_evaluator_give_the_same_bits(pulse: str) -> None:
    trajectory = move(pulse=pulse)
    evaluator = Evaluator(trajectory)
    s = np.concatenate([np.linspace(-0.1, trajectory.duration + 0.1, 500), trajectory.knots])
    many = np.array(trajectory.sample(s))
    for i, x in enumerate(s.tolist()):
        assert np.array(trajectory.evaluate(x)).tobytes() == many[:, i].tobytes()
        assert np.array(evaluator.at(x)).tobytes() == many[:, i].tobytes()


def test_evaluation_is_horner_and_nothing_else() -> None:
    """The recipe for replay, in plain floats: the bits must not depend on how an array library sums."""
    trajectory = move()
    for s in np.linspace(0.01, trajectory.duration - 0.01, 200).tolist():
        i = int(np.searchsorted(trajectory.knots, s, side="right")) - 1
        x = s - float(trajectory.knots[i])
        for axis, got in enumerate(np.array(trajectory.evaluate(s)).T.tolist()):
            c0, c1, c2, c3 = trajectory.coefficients[i, :, axis].tolist()
            assert got[0] == ((c3 * x + c2) * x + c1) * x + c0
            assert got[1] == ((0.0 * x + 3.0 * c3) * x + 2.0 * c2) * x + c1
            assert got[2] == (6.0 * c3) * x + 2.0 * c2
            assert got[3] == 6.0 * c3


def test_limits_at_knots_and_between() -> None:
    for minimise in MINIMISE:
        trajectory = move(minimise)
        s = np.union1d(np.linspace(0.0, trajectory.duration, 5001), trajectory.knots)
        for value, limit in zip(trajectory.sample(s)[1:], (V, A, J), strict=True):
            assert (np.abs(value).max(axis=0) <= limit * (1 + 2e-15)).all()


def test_boundaries_that_nearly_coincide_are_one_knot() -> None:
    """Two axes whose phases end an ulp or two apart."""
    distances = [1.0, 1.0 + 4e-16, 1.0 - 3e-16, 0.7]
    profile = synchronise(distances, [0.5] * 4, [0.7] * 4, [1.4] * 4, "jerk")
    trajectory = from_profiles(np.zeros(4), profile)
    assert np.diff(trajectory.knots).min() > 1e-3
    assert trajectory.evaluate(trajectory.duration)[0] == pytest.approx(distances, rel=0)


def test_nothing_to_move() -> None:
    trajectory = from_profiles(START, synchronise(np.zeros(6), V, A, J), START)
    assert trajectory.duration == 0.0
    assert trajectory.coefficients.shape == (0, 4, 6)
    for s in (-1.0, 0.0, 1.0):
        q, *rest = trajectory.evaluate(s)
        assert (q == START).all()
        assert not np.any(rest)
        assert (trajectory.sample([s])[0] == START).all()


def test_target_that_is_not_the_profiles() -> None:
    profile = synchronise(TARGET - START, V, A, J)
    wrong = TARGET.copy()
    wrong[3] += 1e-12
    with pytest.raises(ValueError, match="target, axis 3"):
        from_profiles(START, profile, wrong)
    with pytest.raises(ValueError, match="target, axis 0"):
        from_profiles(START, profile, np.full(6, np.nan))
    with pytest.raises(ValueError, match="start: expected 6"):
        from_profiles(START[:5], profile)
    with pytest.raises(ValueError, match="target: expected 6"):
        from_profiles(START, profile, TARGET[:5])


def test_shapes_must_agree() -> None:
    good = move()
    with pytest.raises(ValueError, match="shapes do not agree"):
        Trajectory(good.knots[:-1], good.coefficients, good.start, good.end)
    with pytest.raises(ValueError, match="shapes do not agree"):
        Trajectory(good.knots, good.coefficients[:, :3], good.start, good.end)


def test_concatenate_with_rests() -> None:
    """V.C.1: there with one pulse, a rest, and back with the other."""
    there = move()
    back = from_profiles(TARGET, synchronise(START - TARGET, V, A, J, pulse="parabolic"), START)
    both = concatenate([there, back], [0.5])
    assert both.coefficients.shape[1] == 6
    assert both.duration == pytest.approx(there.duration + 0.5 + back.duration, rel=1e-15)
    assert (both.start == START).all()
    assert (both.end == START).all()
    q, *rest = both.evaluate(there.duration + 0.25)
    assert (q == TARGET).all()
    assert not np.any(rest)
    s = np.linspace(0.0, 1.0, 101)[1:-1]
    first, second = both.sample(s * there.duration), both.sample(there.duration + 0.5 + s * back.duration)
    for k in range(3):
        assert first[k] == pytest.approx(there.sample(s * there.duration)[k], rel=0, abs=1e-14)
        assert second[k] == pytest.approx(back.sample(s * back.duration)[k], abs=1e-13)


def test_concatenate_without_rests() -> None:
    there = move()
    back = from_profiles(TARGET, synchronise(START - TARGET, V, A, J), START)
    both = concatenate([there, back, there])
    assert both.duration == pytest.approx(2 * there.duration + back.duration, rel=1e-15)
    assert (np.diff(both.knots) > 0.0).all()
    assert both.evaluate(there.duration)[0] == pytest.approx(TARGET, rel=0)
    assert (concatenate([there]).coefficients == there.coefficients).all()


def test_concatenate_keeps_knots_increasing_far_along() -> None:
    """A segment that s cannot resolve any more is left out."""
    tiny = from_profiles([0.0], synchronise([1e-40], [1.0], [1.0], [1.0]))
    back = from_profiles(tiny.end, synchronise([-1e-40], [1.0], [1.0], [1.0]), [0.0])
    far = concatenate([tiny, back, tiny], [1e4, 1.0])
    assert (np.diff(far.knots) > 0.0).all()
    assert far.evaluate(2e4)[0] == pytest.approx([1e-40], rel=0)


def test_concatenate_refuses_jumps_and_bad_rests() -> None:
    there = move()
    with pytest.raises(ValueError, match=r"trajectory 1, axis 0: starts at 0\.1, the one before ends at 1\.8"):
        concatenate([there, there])
    with pytest.raises(ValueError, match="dwells: expected 0"):
        concatenate([there], [1.0])
    with pytest.raises(ValueError, match="dwells"):
        concatenate([there, there], [-1.0])
    with pytest.raises(ValueError, match="at least one"):
        concatenate([])
    with pytest.raises(ValueError, match="1 axes after 6"):
        concatenate([there, from_profiles([0.0], synchronise([1.0], [1.0], [1.0], [1.0]))])


def test_arrays_may_be_views_of_read_only_memory() -> None:
    original = move()
    parts = (original.knots, original.coefficients, original.start, original.end)
    views = [np.frombuffer(p.tobytes(), dtype=np.float64).reshape(p.shape) for p in parts]
    copy = Trajectory(*views)
    for s in (-1.0, 1.0, 9.0):
        assert np.array(copy.evaluate(s)).tobytes() == np.array(original.evaluate(s)).tobytes()
