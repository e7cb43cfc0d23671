"""Inverse kinematics of UR arms of any size, in any configuration, right angles and their neighbourhood included."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from axisync_robot.poses import (
    distances,
    quaternion_of_rotation,
    rotation_of_quaternion,
    rotation_of_vector,
    rotation_of_zyz,
    vector_of_rotation,
    zyz_of_rotation,
)
from axisync_robot.ur_inverse import UrInverse
from axisync_robot.ur_inverse_geometry import UrGeometry

Array = NDArray[np.float64]

length = st.floats(0.05, 0.8)
signed = st.builds(math.copysign, length, st.sampled_from([-1.0, 1.0]))
offset = st.one_of(st.just(0.0), st.floats(-0.2, 0.2).filter(lambda x: abs(x) > 1e-3))
right = st.integers(-2, 2).map(lambda n: n * math.pi / 2)
near = st.floats(-14.0, -1.0).map(lambda power: 10.0**power)
angle = st.one_of(
    st.floats(-math.pi, math.pi),
    right,
    st.builds(lambda at, off, sign: at + sign * off, right, near, st.sampled_from([-1.0, 1.0])),
)
joints = st.lists(angle, min_size=6, max_size=6).map(np.array)
geometries = st.builds(
    UrGeometry, d1=offset, a2=signed, a3=signed, d4=offset, d5=offset, d6=offset, theta=st.just((0.0,) * 6)
)


@settings(max_examples=500, deadline=None)
@given(geometry=geometries, q=joints, reference=joints)
def test_no_pose_is_lost_and_every_solution_reaches_it(geometry: UrGeometry, q: Array, reference: Array) -> None:
    inverse = UrInverse(geometry, np.eye(4), np.full(6, -20.0), np.full(6, 20.0))
    pose = inverse.forward(q)
    for near_by in (q, reference):
        found = inverse.solve(pose[None], near_by)
        angles = found.angles[found.reachable]
        assert len(angles) > 0
        apart, turn = distances(inverse.forward(angles), np.broadcast_to(pose, (len(angles), 4, 4)))
        assert apart.max() < 1e-9
        assert turn.max() < 1e-9
        assert np.abs(angles - near_by).max() <= math.pi + 1e-9


@settings(max_examples=300, deadline=None)
@given(angles=st.lists(angle, min_size=3, max_size=3).map(np.array))
def test_every_form_of_an_orientation_is_the_same_rotation(angles: Array) -> None:
    rotation = rotation_of_zyz(angles)
    for back in (
        rotation_of_zyz(zyz_of_rotation(rotation)),
        rotation_of_quaternion(quaternion_of_rotation(rotation)),
        rotation_of_vector(vector_of_rotation(rotation)),
    ):
        assert np.abs(back - rotation).max() < 1e-11
