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
from axisync_robot.numeric_inverse import NumericInverse
from axisync_robot.poses import distances, pose_of, rotation_of_vector
from axisync_robot.ur_inverse import UrInverse
from axisync_schemas.cell import Group
from support.arms import arm_of, cell, down, line, solver

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


def through_the_wrist(count: int, other: float = 0.4) -> Array:
    """[count, 6]: q5 from 0.5 to -0.5, the others on curves of their own."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    q = START + other * np.sin(share * np.array([1.1, 0.7, -0.9, 1.4, 0.0, -1.6]))
    q[:, 4] = 0.5 - share[:, 0]
    return q


@pytest.mark.parametrize("count", [400, 401, 40])
def test_straight_through_the_wrist_the_joints_go_on(count: int) -> None:
    """Between two samples, and with one on the singularity itself: there q6 lies on the curve of its neighbours."""
    q = through_the_wrist(count)
    inverse = solver(KINGKONG)
    assert inverse.solve(inverse.forward(q), START).free.any() == (count % 2 == 1)
    found = follow(inverse, inverse.forward(q), q[0])
    middle = slice(count // 2 - 1, count // 2 + 2)
    assert np.abs(found.angles[middle] - q[middle]).max() < (1e-9 if count > 100 else 1e-5)
    assert np.abs(np.delete(found.angles - q, middle, axis=0)).max() < 1e-10
    apart, turn = distances(inverse.forward(found.angles), inverse.forward(q))
    assert max(apart.max(), turn.max()) < 1e-9


def test_a_path_that_ends_at_the_singular_wrist_ends_smoothly() -> None:
    q = through_the_wrist(401)[:201]
    inverse = solver(KINGKONG)
    assert abs(q[-1, 4]) < 1e-15
    assert np.abs(follow(inverse, inverse.forward(q), q[0]).angles - q).max() < 1e-7


def test_through_the_wrist_there_and_back_and_through_its_other_end() -> None:
    there = through_the_wrist(300)
    back = np.concatenate([there, there[-2::-1]])
    inverse = solver(KINGKONG, 5.0)
    found = follow(inverse, inverse.forward(back), back[0]).angles
    assert np.abs(found - back).max() < 1e-9
    past = there + np.array([0.0, 0.0, 0.0, 0.0, math.pi, 0.0])
    assert np.abs(follow(inverse, inverse.forward(past), past[0]).angles - past).max() < 1e-9


def test_numeric_solutions_go_through_the_wrist_too() -> None:
    q = through_the_wrist(400)
    arm = arm_of(KINGKONG)
    numeric = NumericInverse(arm, [-3.0] * 6, [3.0] * 6)
    assert np.abs(follow(numeric, arm.placements(q), q[0]).angles - q).max() < 1e-6


def test_a_corner_at_the_singular_wrist_needs_the_other_branch() -> None:
    """There the tool stops tilting one way and goes on tilting across it: q4 and q6 would have to turn at once."""
    inverse = solver(KINGKONG)
    q = through_the_wrist(200, 0.0)[:100]
    last = inverse.forward(np.array([*q[-1, :4], 0.0, q[-1, 5]]))
    tilt = np.linspace(0.0, 0.2, 100)[1:, None] * np.array([math.cos(q[-1, 5]), -math.sin(q[-1, 5]), 0.0])
    turned = last[:3, :3] @ rotation_of_vector(tilt)
    d6 = inverse.geometry.d6
    fifth = last[:3, 3] - d6 * last[:3, 2]
    poses = np.concatenate([inverse.forward(q), pose_of(fifth + d6 * turned[..., 2], turned)])
    error = refused(inverse, poses, q[0])
    assert isinstance(error, BranchChange | Singular)
    assert error.sample == 100


@pytest.mark.parametrize(("miss", "passes"), [(1e-8, True), (1e-5, False), (1e-3, False)])
def test_how_near_is_through(miss: float, passes: bool) -> None:
    """Past the singularity at `miss` rad, in steps of 2.5e-3 rad, q4 and q6 swing by half a turn in all truth."""
    inverse = solver(KINGKONG)
    q = through_the_wrist(400, 0.0)
    poses = inverse.forward(q)
    across = np.array([math.cos(START[5]), -math.sin(START[5]), 0.0])
    poses[:, :3, :3] = poses[:, :3, :3] @ rotation_of_vector(miss * across)
    start = inverse.solve(poses[:1], q[0])
    near = start.angles[0, int(np.nanargmin(np.abs(start.angles[0] - q[0]).max(axis=1)))]
    if passes:
        found = follow(inverse, poses, near).angles
        assert np.abs(np.diff(found, 2, axis=0)).max() < 1e-4
        apart, turn = distances(inverse.forward(found), poses)
        assert max(apart.max(), turn.max()) < 1e-9
        return
    error = refused(inverse, poses, near)
    assert isinstance(error, BranchChange | Singular)
    assert 190 < error.sample < 210


def test_a_limit_beyond_the_wrist_is_still_a_limit() -> None:
    q = through_the_wrist(400)
    inverse = solver(KINGKONG)
    low, high = np.full(6, -math.tau), np.full(6, math.tau)
    low[4] = -0.3
    bound = UrInverse(inverse.geometry, inverse.base, low, high)
    error = refused(bound, inverse.forward(q), q[0])
    assert isinstance(error, LimitReached)
    assert (error.joint, error.bound) == (4, -0.3)
    assert error.sample == int((q[:, 4] < -0.3).argmax())
    low[4] = 0.0
    at_once = refused(UrInverse(inverse.geometry, inverse.base, low, high), inverse.forward(q), q[0])
    assert isinstance(at_once, LimitReached)
    assert (at_once.sample, at_once.joint, at_once.bound) == (200, 4, 0.0)


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
