"""Following one branch along a path, and every reason why it may end, with its sample and numbers."""

import math
import pickle

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.inverse import follow
from axisync_robot.inverse_errors import (
    BranchChange,
    LimitReached,
    PathRefused,
    Singular,
    StartsElsewhere,
    Unreachable,
)
from axisync_robot.poses import distances, pose_of, rotation_of_vector
from axisync_robot.ur_inverse import UrInverse
from axisync_schemas.cell import Group
from support.arms import cell, down, line, solver

Array = NDArray[np.float64]
KINGKONG, WUKONG = cell().groups
START = np.radians([10.0, -70.0, 80.0, -20.0, 50.0, 30.0])


def ramp(start: Array, end: Array, count: int = 400) -> Array:
    share: Array = np.linspace(0.0, 1.0, count)[:, None]
    return start + share * (end - start)


def refused(inverse: UrInverse, poses: Array, start: Array) -> PathRefused:
    with pytest.raises(PathRefused) as caught:
        follow(inverse, poses, start)
    error = pickle.loads(pickle.dumps(caught.value))
    assert type(error) is type(caught.value)
    assert str(error) == str(caught.value)
    assert str(error.sample) in str(error) or isinstance(error, StartsElsewhere)
    if error.sample > 1 and not isinstance(error, StartsElsewhere):
        assert len(follow(inverse, poses[: error.sample], start).angles) == error.sample
    return error


@pytest.mark.parametrize("group", [KINGKONG, WUKONG], ids=lambda g: g.name)
def test_a_joint_path_comes_back(group: Group) -> None:
    inverse = solver(group)
    rng = np.random.default_rng(1)
    for _ in range(20):
        start = rng.uniform(-3.0, 3.0, 6)
        start[[2, 4]] = rng.uniform(0.4, 2.6, 2) * rng.choice([-1.0, 1.0], 2)
        q = ramp(start, start + rng.uniform(-0.2, 0.2, 6))
        g, phi = inverse.geometry, q[:, 1:4].sum(axis=1)
        ahead = g.a2 * np.cos(q[:, 1]) + g.a3 * np.cos(q[:, 1] + q[:, 2]) + g.d5 * np.sin(phi)
        if (ahead > 0.01).all() or (ahead < -0.01).all():
            assert np.abs(follow(inverse, inverse.forward(q), start).angles - q).max() < 1e-9


def test_a_path_over_more_than_a_turn_is_unwrapped() -> None:
    q = ramp(START, START + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 9.0]), 800)
    inverse = solver(KINGKONG, 20.0)
    assert np.abs(follow(inverse, inverse.forward(q), START).angles - q).max() < 1e-9


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, 1, -1), (-1, -1, -1)])
def test_from_home_where_all_branches_meet(signs: tuple[int, int, int]) -> None:
    """Shoulder, elbow and wrist are singular at the start: the path decides."""
    home = np.radians([0.0, -90.0, 0.0, -90.0, 0.0, 0.0])
    turn = np.array([0.1, 0.2, 0.5 * signs[1], 0.2, 0.4 * signs[2], 0.0])
    turn[1] *= signs[0]
    q = ramp(home, home + turn)
    inverse = solver(KINGKONG)
    found = follow(inverse, inverse.forward(q), home).angles
    assert distances(inverse.forward(found), inverse.forward(q))[0].max() < 1e-9
    assert np.abs(found[-1] - q[-1]).max() < 1e-7


def test_a_wrist_singular_all_along_keeps_its_last_joint() -> None:
    start = np.radians([10.0, -70.0, 80.0, -20.0, 0.0, 30.0])
    q = ramp(start, start + np.array([0.3, -0.2, 0.2, 0.4, 0.0, 0.0]))
    inverse = solver(KINGKONG)
    assert np.abs(follow(inverse, inverse.forward(q), start).angles - q).max() < 1e-9


def test_a_wrist_that_becomes_singular_keeps_the_last_joint_it_had() -> None:
    share = np.linspace(0.0, 1.0, 101)[:, None]
    before = START + share * np.array([0.1, 0.1, 0.1, 0.1, -START[4], 1.0])
    before[-1, 4] = 0.0
    q = np.concatenate([before, before[-1] + share * np.array([0.2, 0.1, -0.2, 0.3, 0.0, 0.0])])
    inverse = solver(KINGKONG)
    assert np.abs(follow(inverse, inverse.forward(q), START).angles - q).max() < 0.02


@pytest.mark.parametrize("bend", [-0.5, 0.5])
def test_from_a_stretched_elbow_either_way(bend: float) -> None:
    """The square root of rounding must not decide which way the elbow bends."""
    inverse, rng = solver(KINGKONG), np.random.default_rng(4)
    for _ in range(10):
        start = START + rng.uniform(-0.3, 0.3, 6)
        start[2] = 0.0
        q = ramp(start, start + np.array([0.1, 0.1, bend, 0.1, 0.1, 0.1]))
        assert np.abs(follow(inverse, inverse.forward(q), start).angles - q).max() < 1e-6


def test_the_tool_change_lines_stay_on_one_branch() -> None:
    inverse = solver(KINGKONG, math.radians(170.0))
    for x, y in ((-0.2719, 0.157), (-0.3484, 0.23)):
        poses = line(down(x, y, 0.3), down(x, y, 0.1), 1000)
        first = inverse.solve(poses[:1], np.zeros(6))
        followed = 0
        for branch in np.flatnonzero(first.within[0]):
            try:
                found = follow(inverse, poses, first.angles[0, branch])
            except LimitReached:
                continue
            followed += 1
            assert found.branch == branch
            apart, turn = distances(inverse.forward(found.angles), poses)
            assert max(apart.max(), turn.max()) < 1e-9
        assert followed >= 3


def test_out_of_reach_says_where_how_far_and_what_is_near() -> None:
    inverse = solver(KINGKONG)
    first = inverse.forward(START)
    last = first.copy()
    last[:3, 3] += [1.0, 0.0, 0.0]
    poses = line(first, last, 1001)
    error = refused(inverse, poses, START)
    assert isinstance(error, Unreachable)
    assert not inverse.solve(poses[error.sample : error.sample + 1], START).reachable.any()
    assert 0.0 < error.distance < 0.002
    assert error.distance == pytest.approx(np.linalg.norm(error.nearest[:3, 3] - poses[error.sample, :3, 3]))
    assert inverse.solve(error.nearest[None], START).reachable.any()
    assert error.turn == 0.0


def test_the_first_pose_out_of_reach_is_sample_zero() -> None:
    stretched = START * np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0])
    inverse = solver(KINGKONG)
    pose = inverse.forward(stretched)
    away = pose[:3, 3] - inverse.centre
    pose[:3, 3] += 9e-7 * away / np.linalg.norm(away)
    error = refused(inverse, pose[None], stretched)
    assert isinstance(error, Unreachable)
    assert error.sample == 0
    assert 1e-8 < error.distance < 1e-6


def test_crossing_the_wrist_needs_the_other_branch() -> None:
    q = ramp(START, START - np.array([0.0, 0.0, 0.0, 0.0, math.radians(60.0), 0.0]), 401)
    inverse = solver(KINGKONG)
    error = refused(inverse, inverse.forward(q), START)
    assert isinstance(error, BranchChange)
    assert error.sample == int((q[:, 4] < -1e-10).argmax())
    assert error.branch ^ error.other == 1
    assert error.step < 0.01
    assert "other wrist" in str(error)


def test_passing_near_a_singular_wrist_is_a_jump() -> None:
    """The tool turns about the wrist's centre, past the plane's normal at 1e-3 rad."""
    inverse = solver(KINGKONG)
    start = START.copy()
    start[4] = math.radians(5.0)
    pose = inverse.forward(start)
    normal = np.array([math.sin(start[4]) * math.cos(start[5]), -math.sin(start[4]) * math.sin(start[5]), 0.0])
    axis = np.cross([0.0, 0.0, 1.0], normal / np.linalg.norm(normal)) + 0.01 * normal / np.linalg.norm(normal)
    turned = pose[:3, :3] @ rotation_of_vector(np.linspace(0.0, 0.17, 200)[:, None] * axis)
    d6 = inverse.geometry.d6
    fifth = pose[:3, 3] - d6 * pose[:3, 2]
    error = refused(inverse, pose_of(fifth + d6 * turned[..., 2], turned), start)
    assert isinstance(error, Singular)
    assert error.where == "wrist"
    assert error.joint in (3, 5)
    assert abs(error.step) > error.bound
    assert 80 < error.sample < 120


def test_a_limit_on_the_way() -> None:
    limit = math.radians(100.0)
    q = ramp(START, START + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]))
    inverse = solver(KINGKONG, limit)
    error = refused(inverse, inverse.forward(q), START)
    assert isinstance(error, LimitReached)
    assert error.joint == 5
    assert error.bound == limit
    assert error.sample == int((q[:, 5] > limit).argmax())
    assert error.value == pytest.approx(q[error.sample, 5])


def test_a_start_beyond_its_limit() -> None:
    inverse = solver(KINGKONG, 1.0)
    error = refused(inverse, inverse.forward(START)[None], START)
    assert isinstance(error, LimitReached)
    assert (error.sample, error.joint) == (0, 2)


def test_a_start_elsewhere() -> None:
    inverse = solver(KINGKONG)
    error = refused(inverse, inverse.forward(START)[None], START + 0.01)
    assert isinstance(error, StartsElsewhere)
    assert error.distance > 1e-3
    assert error.turn > 1e-3
