"""Conversions against plain products of turns, at their singular places too."""

import math
import pickle

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.chain import rotation_x, rotation_y, rotation_z
from axisync_robot.poses import (
    Frame,
    NotUnitQuaternion,
    distances,
    from_body,
    in_body,
    inverse_pose,
    pose_of_quaternion,
    pose_of_zyz,
    quaternion_of_rotation,
    rotation_of_quaternion,
    rotation_of_vector,
    rotation_of_zyz,
    unit_quaternion,
    vector_of_rotation,
    zyz_of_rotation,
)

Array = NDArray[np.float64]
RNG = np.random.default_rng(11)


def zyz_product(angles: Array) -> Array:
    product: Array = rotation_z(angles[0]) @ rotation_y(angles[1]) @ rotation_z(angles[2])
    return product


def test_zyz_is_the_product_of_three_turns() -> None:
    angles = RNG.uniform(-7.0, 7.0, (200, 3))
    expected = np.stack([zyz_product(row) for row in angles])
    assert np.abs(rotation_of_zyz(angles) - expected).max() < 1e-15


def test_zyz_comes_back() -> None:
    angles = np.stack(
        [RNG.uniform(-3.1, 3.1, 500), RNG.uniform(0.01, math.pi - 0.01, 500), RNG.uniform(-3.1, 3.1, 500)], axis=-1
    )
    assert np.abs(zyz_of_rotation(rotation_of_zyz(angles)) - angles).max() < 1e-12


@pytest.mark.parametrize("beta", [0.0, math.pi, 1e-14, math.pi - 1e-14])
def test_singular_zyz_gives_the_same_rotation_with_gamma_zero(beta: float) -> None:
    rotation = rotation_of_zyz(np.array([0.7, beta, -1.9]))
    found = zyz_of_rotation(rotation)
    assert found[2] == 0.0
    assert np.abs(rotation_of_zyz(found) - rotation).max() < 1e-13


def test_the_paper_s_angles() -> None:
    pose = pose_of_zyz([0.1, 0.2, 0.3], np.radians([90.0, 75.0, 180.0]))
    assert pose[:3, 3].tolist() == [0.1, 0.2, 0.3]
    assert np.degrees(zyz_of_rotation(pose[:3, :3]))[:2] == pytest.approx([90.0, 75.0], abs=1e-12)


def test_quaternions_come_back_with_w_positive() -> None:
    q = RNG.normal(size=(1000, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    q[:4] = np.eye(4)
    found = quaternion_of_rotation(rotation_of_quaternion(q))
    assert (found[:, 3] >= 0.0).all()
    assert np.minimum(np.abs(found - q).max(axis=1), np.abs(found + q).max(axis=1)).max() < 2e-15


def test_a_quaternion_about_each_axis() -> None:
    half = math.radians(20.0)
    for axis, turn in enumerate((rotation_x, rotation_y, rotation_z)):
        q = np.zeros(4)
        q[axis], q[3] = math.sin(half), math.cos(half)
        assert np.abs(rotation_of_quaternion(q) - turn(2.0 * half)).max() < 1e-15


def test_nearly_unit_quaternions_are_normalised() -> None:
    for length in (1.0 - 0.99e-3, 1.0 + 0.99e-3):
        assert np.linalg.norm(unit_quaternion([0.0, 0.6 * length, 0.0, 0.8 * length])) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("length", [0.0, 0.9989, 1.0011, math.nan, math.inf])
def test_other_quaternions_are_refused_with_value_and_bound(length: float) -> None:
    with pytest.raises(NotUnitQuaternion) as caught:
        pose_of_quaternion([0.0, 0.0, 0.0], [[0.0, 0.0, 0.0, 1.0], [length, 0.0, 0.0, 0.0]])
    assert caught.value.value == pytest.approx(length, nan_ok=True)
    assert (caught.value.bound, caught.value.index) == (1e-3, 1)
    assert "0.001" in str(pickle.loads(pickle.dumps(caught.value)))


def test_rotation_vectors_come_back() -> None:
    for size in (0.0, 1e-300, 1e-12, 1e-6, 0.3, 3.0, math.pi - 1e-9, math.pi):
        directions = RNG.normal(size=(50, 3))
        vectors = size * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        rotations = rotation_of_vector(vectors)
        assert np.abs(rotations @ rotations.swapaxes(-1, -2) - np.eye(3)).max() < 2e-15
        found = vector_of_rotation(rotations)
        same = np.abs(found - vectors).max(axis=1)
        if size > 3.1:
            same = np.minimum(same, np.abs(found + vectors).max(axis=1))
        assert same.max() < 1e-14


def test_a_rotation_vector_turns_about_its_direction() -> None:
    assert np.abs(rotation_of_vector([0.0, 0.0, 0.4]) - rotation_z(0.4)).max() < 1e-15
    assert np.abs(rotation_of_vector([-2.0, 0.0, 0.0]) - rotation_x(-2.0)).max() < 1e-15


def test_frames() -> None:
    base = pose_of_zyz([0.07, 0.1373, 0.0894], [0.2, -1.1, 0.5])
    poses = pose_of_zyz(RNG.normal(size=(5, 3)), RNG.normal(size=(5, 3)))
    in_o = in_body(poses, Frame.BASE, base)
    assert np.abs(in_o[2] - base @ poses[2]).max() < 1e-15
    assert np.abs(from_body(in_o, Frame.BASE, base) - poses).max() < 1e-14
    assert np.array_equal(in_body(poses, Frame.BODY, base), poses)
    assert np.array_equal(from_body(poses, Frame.BODY, base), poses)
    assert np.abs(inverse_pose(poses) @ poses - np.eye(4)).max() < 1e-14


def test_distances() -> None:
    first = pose_of_zyz([0.0, 0.0, 0.0], [0.0, 0.0, 0.1])
    second = pose_of_zyz([0.3, 0.4, 0.0], [0.2, 0.0, 0.2])
    apart, turn = distances(first, second)
    assert apart == pytest.approx(0.5)
    assert turn == pytest.approx(0.3)
