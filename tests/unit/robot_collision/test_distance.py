"""Segment distances against dense sampling."""

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.collision_distance import segment_to_box, segment_to_segment

Array = NDArray[np.float64]

pytestmark = pytest.mark.usefixtures("each_backend")


def along(segments: Array, count: int) -> Array:
    """[m, count, 3]."""
    t = np.linspace(0.0, 1.0, count)[None, :, None]
    return segments[:, None, 0] + t * (segments[:, None, 1] - segments[:, None, 0])


def test_segments_against_dense_sampling() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-1, 1, (2, 200, 2, 3))
    b[:40, 1] = b[:40, 0] + 0.7 * (a[:40, 1] - a[:40, 0])  # parallel
    b[40:60, 1] = b[40:60, 0]  # points
    a[50:70, 1] = a[50:70, 0]
    b[70:90, 1] = b[70:90, 0] + (a[70:90, 1] - a[70:90, 0]) + 1e-9 * rng.uniform(-1, 1, (20, 3))  # nearly parallel
    gaps = np.linalg.norm(along(a, 200)[:, :, None] - along(b, 200)[:, None, :], axis=3).min(axis=(1, 2))
    found = segment_to_segment(a, b)
    assert (found <= gaps + 1e-12).all()
    assert (gaps - found).max() < 0.02


def test_crossing_segments_touch() -> None:
    a = np.array([[[-1.0, 0, 0], [1, 0, 0]], [[-1, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]]])
    b = np.array([[[0.0, -1, 0], [0, 1, 0]], [[0, -1, 0.3], [0, 1, 0.3]], [[2, 0, 0], [5, 0, 0]]])
    assert np.allclose(segment_to_segment(a, b), [0.0, 0.3, 1.0], atol=1e-15)


def test_boxes_against_dense_sampling() -> None:
    rng = np.random.default_rng(2)
    a, half = rng.uniform(-2, 2, (300, 2, 3)), rng.uniform(0.1, 1, (300, 3))
    a[:30, 1] = a[:30, 0]
    a[30:60, 1, 2] = a[30:60, 0, 2]  # parallel to a face
    points = along(a, 2000)
    gaps = np.linalg.norm(points - np.clip(points, -half[:, None], half[:, None]), axis=2).min(axis=1)
    found = segment_to_box(a, half)
    assert (found <= gaps + 1e-12).all()
    assert (gaps - found).max() < 0.003
    assert (found == 0.0).any()
    assert (found > 0.0).sum() > 100
