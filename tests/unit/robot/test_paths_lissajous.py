"""Arc length of Lissajous curves against closed forms, its smoothness against exact derivatives, and its refusals."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.paths import lissajous
from axisync_robot.paths_errors import Cusp, OutOfRange, ZeroCurve
from axisync_robot.poses import pose_of, rotation_of_vector

Array = NDArray[np.float64]

START = pose_of([0.4, -0.1, 0.7], rotation_of_vector(np.array([0.2, 1.0, -0.5])))
HALF_PI = math.pi / 2

ELLIPSES = [(0.2, 0.15), (0.3, 0.03), (0.3, 0.002), (0.3, 0.00045)]
"""Semi-axes, m; the last turns at its ends within 0.7 um."""


def perimeter(a: float, b: float) -> float:
    """By the arithmetic-geometric mean (Gauss)."""
    share, weight, mean, other = 0.5 * (a * a - b * b), 1.0, a, b
    total = a * a - share
    while abs(mean - other) > 1e-17:
        half = 0.5 * (mean - other)
        mean, other = 0.5 * (mean + other), math.sqrt(mean * other)
        total -= weight * half * half
        weight *= 2.0
        if half < 1e-12:
            break
    return math.tau * total / mean


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
def test_the_perimeter_of_an_ellipse(a: float, b: float) -> None:
    path = lissajous(START, [a, b, 0], [1, 1, 0], [0, HALF_PI, 0])
    assert path.distances[0] == pytest.approx(perimeter(a, b), rel=1e-13)
    assert path.distances[1] == 0.0
    assert np.abs(path.end - START).max() < 1e-15


@pytest.mark.parametrize(("a", "b"), ELLIPSES)
def test_the_tool_is_on_the_ellipse_from_the_start_on(a: float, b: float) -> None:
    path = lissajous(START, [a, b, 0], [1, 1, 0], [0, HALF_PI, 0])
    offsets = path.poses(np.linspace(0.0, 1.0, 999)[:, None] * path.distances)[:, :3, 3] - START[:3, 3]
    assert np.abs(np.hypot(offsets[:, 0] / a, offsets[:, 1] / b + 1.0) - 1.0).max() < 1e-11 / b * 1e-2


def test_a_circle_is_exact_and_fast_periods_too() -> None:
    path = lissajous(START, [0.2, 0.2, 0], [40, 40, 0], [0, HALF_PI, 0])
    assert path.distances[0] == pytest.approx(80 * math.pi * 0.2, rel=1e-14)
    angle = np.linspace(0.0, 80 * math.pi, 4001)
    offsets = path.poses(np.stack([0.2 * angle, 0.0 * angle], axis=-1))[:, :3, 3] - START[:3, 3]
    expected = 0.2 * np.stack([np.sin(angle), np.cos(angle) - 1.0, 0.0 * angle], axis=-1)
    assert np.abs(offsets - expected).max() < 5e-13


def test_without_a_full_period_it_ends_where_the_formula_says() -> None:
    amplitude, frequency, phase = np.array([0.1, 0.2, -0.05]), np.array([1.3, -0.7, 2.2]), np.array([0.4, 1.0, -9.0])
    turned = rotation_of_vector(np.array([0.0, 0.7, 0.1]))
    path = lissajous(START, amplitude, frequency, phase, turned, "euler_zyz")
    expected = START[:3, 3] + amplitude * (np.sin(math.tau * frequency + phase) - np.sin(phase))
    assert path.end == pytest.approx(pose_of(expected, turned), abs=1e-15)
    ends = path.poses(np.stack([np.zeros(4), path.distances]))
    assert np.abs(ends - np.stack([START, path.end])).max() < 1e-15


def third_of_ellipse(a: float, b: float, angle: Array) -> Array:
    """d3p/ds3 of (a sin, b cos), [k, 2], by hand: with w = ds/dangle."""
    sine, cosine = np.sin(angle), np.cos(angle)
    w = np.hypot(a * cosine, b * sine)
    w1 = (b * b - a * a) * sine * cosine / w
    w2 = ((b * b - a * a) * (cosine**2 - sine**2) - w1 * w1) / w
    first = np.stack([a * cosine, -b * sine])
    second, third = np.stack([-a * sine, -b * cosine]), -first
    by_length: Array = third / w**3 - 3.0 * second * w1 / w**4 + first * (3.0 * w1**2 / w**5 - w2 / w**4)
    return by_length.T


@pytest.mark.parametrize(("a", "b"), ELLIPSES[:3])
def test_third_derivatives_by_length_across_all_joints_of_the_polynomials(a: float, b: float) -> None:
    """By differences over a step of the size of the bend, around its tip, where the third derivative is largest."""
    path = lissajous(np.eye(4), [a, b, 0], [1, 1, 0], [0, HALF_PI, 0])
    step = 0.015 * b * b / a
    quarter = 0.25 * path.distances[0]
    centres = quarter + np.linspace(-1.5, 1.5, 301) * b * b / a
    taps = np.arange(-5, 6)
    lengths = centres[:, None] + step * 4 * taps
    positions = path.poses(np.stack([lengths.ravel(), np.zeros(lengths.size)], axis=-1))[:, :2, 3].reshape(301, 11, 2)
    stencil = np.linalg.solve(np.vander(taps.astype(float), increasing=True).T, np.eye(11)[3] * 6.0)
    found = np.einsum("kti,t->ki", positions, stencil) / (4 * step) ** 3
    at_centre = positions[:, 5]
    angle = np.arctan2(at_centre[:, 0] / a, at_centre[:, 1] / b + 1.0)
    expected = third_of_ellipse(a, b, angle)
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("amplitude", "frequency", "phase", "u"),
    [
        ((0.2, 0, 0), (0.5, 0, 0), (0, 0, 0), 0.5),
        ((0.2, 0.1, 0), (1, 2, 0), (0, HALF_PI, 0), 0.25),
        ((0.2, 0.1, 0.1), (0.3, 0.3, 0.3), (-HALF_PI, -HALF_PI, HALF_PI), 0.0),
        ((0.3, 2e-4, 0), (1, 1, 0), (0, HALF_PI, 0), 0.25),
    ],
)
def test_cusps_are_refused_where_they_are(
    amplitude: tuple[float, ...], frequency: tuple[float, ...], phase: tuple[float, ...], u: float
) -> None:
    with pytest.raises(Cusp, match="change a phase") as refused:
        lissajous(START, amplitude, frequency, phase)
    assert min(abs(refused.value.u - u), abs(refused.value.u - u - 0.5)) < 1e-6
    assert refused.value.value < refused.value.bound == 1e-3


def test_before_its_cusp_the_same_curve_is_fine() -> None:
    path = lissajous(START, [0.2, 0, 0], [0.24, 0, 0], [0, 0, 0])
    assert path.distances[0] == pytest.approx(0.2 * math.sin(0.48 * math.pi), rel=1e-14)


def test_curves_without_size_or_beyond_all_sizes_are_refused() -> None:
    with pytest.raises(ZeroCurve, match="Lissajous curve is 0 m long"):
        lissajous(START, [0, 0.1, 0], [1, 0, 2], [0, 0, 0])
    with pytest.raises(OutOfRange, match="frequency: -101 periods; at most 100"):
        lissajous(START, [0.1, 0.1, 0], [1, -101, 0], [0, 1, 0])
    with pytest.raises(OutOfRange, match="amplitude: inf m"):
        lissajous(START, [0.1, math.inf, 0], [1, 1, 0], [0, 1, 0])
