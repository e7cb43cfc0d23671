"""Damped least squares: arms of any number of joints, against the closed form and against its own forward map."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.chain import chain_of_rows
from axisync_robot.inverse import follow, inverse_of
from axisync_robot.inverse_errors import LimitReached, Singular, StartsElsewhere, Unreachable
from axisync_robot.numeric_inverse import POLISHED, NumericInverse
from axisync_robot.poses import distances
from axisync_robot.ur_inverse import UrInverse
from axisync_schemas.cell import DenavitHartenberg, Pose
from support.arms import arm_of, cell, line

Array = NDArray[np.float64]
START = np.radians([10.0, -70.0, 80.0, -20.0, 50.0, 30.0])


def row(d: float, a: float, alpha: float) -> DenavitHartenberg:
    return DenavitHartenberg.model_validate({"d_m": d, "a_m": a, "alpha_deg": alpha})


SEVEN = [
    row(0.34, 0.0, -90.0), row(0.0, 0.0, 90.0), row(0.4, 0.0, 90.0), row(0.0, 0.0, -90.0), row(0.4, 0.0, -90.0),
    row(0.0, 0.0, 90.0), row(0.126, 0.0, 0.0),
]  # fmt: skip
BEND = np.array([0.2, 0.6, -0.3, -1.2, 0.4, 0.9, 0.1])


def seven(limit: float = math.tau) -> NumericInverse:
    found = inverse_of(Arm(Pose(), chain_of_rows(SEVEN)), [-limit] * 7, [limit] * 7)
    assert isinstance(found, NumericInverse)
    return found


def test_the_kind_of_solver_follows_the_geometry() -> None:
    assert isinstance(inverse_of(arm_of(cell().groups[0]), [-3.0] * 6, [3.0] * 6), UrInverse)
    seven()


@pytest.mark.parametrize("joints", [1, 2, 6, 7])
def test_jacobian_is_the_slope_of_the_pose(joints: int) -> None:
    arm, bend = Arm(Pose(), chain_of_rows(SEVEN[-joints:])), BEND[-joints:]
    pose, jacobian = arm.jacobian(bend)
    assert np.array_equal(pose, arm.placement(bend))
    for joint in range(joints):
        step = np.zeros(joints)
        step[joint] = 1e-6
        slope = (arm.placement(bend + step) - arm.placement(bend - step)) / 2e-6
        turn = slope[:3, :3] @ pose[:3, :3].T
        expected = [*slope[:3, 3], turn[2, 1], turn[0, 2], turn[1, 0]]
        assert jacobian[:, joint] == pytest.approx(expected, abs=1e-9)


def test_seeded_near_it_finds_the_pose() -> None:
    inverse, rng = seven(), np.random.default_rng(2)
    for q in rng.uniform(-2.5, 2.5, (60, 7)):
        pose = inverse.arm.placement(q)
        found = inverse.solve(pose, q + rng.uniform(-0.2, 0.2, 7))
        assert found.reached
        apart, turn = distances(inverse.arm.placement(found.angles), pose)
        assert max(apart, turn) < POLISHED


def test_both_solvers_follow_the_same_way() -> None:
    arm = arm_of(cell().groups[0])
    closed, numeric = inverse_of(arm, [-3.0] * 6, [3.0] * 6), NumericInverse(arm, [-3.0] * 6, [3.0] * 6)
    end = arm.placement(START)
    end[:3, 3] += [0.05, -0.04, 0.06]
    poses = line(arm.placement(START), end, 100)
    assert np.abs(follow(closed, poses, START).angles - follow(numeric, poses, START).angles).max() < 1e-12


def test_a_path_of_solutions_is_exact_enough_for_third_derivatives() -> None:
    """Of a smooth path: what the third differences leave beside the path's own is a few units of rounding."""
    arm = arm_of(cell().groups[0])
    numeric = NumericInverse(arm, [-3.0] * 6, [3.0] * 6)
    phase = np.linspace(0.0, math.tau, 701)[:, None]
    q = START + 0.3 * np.sin(phase + np.arange(6.0))
    found = numeric.follow(arm.placements(q), q[0]).angles
    assert np.abs(found - q).max() < 1e-12
    assert np.abs(np.diff(found - q, 3, axis=0)).max() < 4e-12


def test_a_tool_is_brought_to_the_pose() -> None:
    tool = Pose.model_validate({"position_m": (0.02, -0.03, 0.15), "rpy_deg": (20.0, -30.0, 50.0)})
    inverse = inverse_of(Arm(Pose(), chain_of_rows(SEVEN), tool), [-3.0] * 7, [3.0] * 7)
    assert isinstance(inverse, NumericInverse)
    pose = inverse.arm.placement(BEND)
    found = inverse.solve(pose, BEND + 0.1)
    assert found.reached
    assert max(distances(inverse.arm.placement(found.angles), pose)) < POLISHED


def test_seven_joints_follow_a_line() -> None:
    inverse = seven()
    end = inverse.arm.placement(BEND)
    end[:3, 3] += [0.1, -0.1, 0.05]
    poses = line(inverse.arm.placement(BEND), end, 60)
    found = follow(inverse, poses, BEND)
    assert found.branch is None
    reached = np.stack([inverse.arm.placement(q) for q in found.angles])
    apart, turn = distances(reached, poses)
    assert max(apart.max(), turn.max()) < 1e-9
    assert np.abs(np.diff(found.angles, axis=0)).max() < 0.05


def test_a_joint_at_its_limit_leaves_the_way_to_the_others() -> None:
    free = seven()
    end = free.arm.placement(BEND)
    end[:3, 3] += [0.1, -0.1, 0.05]
    poses = line(free.arm.placement(BEND), end, 60)[:50]
    wanted = free.follow(poses, BEND).angles
    joint = 0  # what the elbow, swivelling about shoulder and wrist, makes up for
    low, high = np.full(7, -math.tau), np.full(7, math.tau)
    low[joint], high[joint] = BEND[joint] - 0.01, BEND[joint] + 0.01
    assert abs(wanted[-1, joint] - BEND[joint]) > 0.012
    bound = NumericInverse(free.arm, low, high)
    found = bound.follow(poses, BEND).angles
    assert abs(found[-1, joint] - BEND[joint]) == pytest.approx(0.01, abs=1e-9)
    apart, turn = distances(np.stack([free.arm.placement(q) for q in found]), poses)
    assert max(apart.max(), turn.max()) < 1e-9
    assert bound.solve(poses[-1], found[-2]).iterations <= 6


def test_out_of_reach() -> None:
    inverse = seven()
    end = inverse.arm.placement(BEND)
    end[:3, 3] += [2.0, 0.0, 0.0]
    poses = line(inverse.arm.placement(BEND), end, 60)
    with pytest.raises(Unreachable) as caught:
        follow(inverse, poses, BEND)
    error = caught.value
    assert 1 < error.sample < 40
    apart, turn = distances(error.nearest, poses[error.sample])
    assert (error.distance, error.turn) == (pytest.approx(apart, abs=1e-9), pytest.approx(turn, abs=1e-9))
    assert max(apart, turn) > 1e-6


def test_a_limit_in_the_way_is_named() -> None:
    arm = arm_of(cell().groups[0])
    low, high = np.full(6, -3.0), np.full(6, 3.0)
    high[5] = START[5] + 0.1
    inverse = NumericInverse(arm, low, high)
    poses = np.stack([arm.placement(START + np.array([0, 0, 0, 0, 0, 0.01 * i])) for i in range(20)])
    with pytest.raises(LimitReached) as caught:
        inverse.follow(poses, START)
    assert (caught.value.sample, caught.value.joint, caught.value.bound) == (11, 5, high[5])
    assert caught.value.value == pytest.approx(START[5] + 0.11)


def test_jumps_and_wrong_starts() -> None:
    inverse = seven()
    first, second = inverse.arm.placement(BEND), inverse.arm.placement(BEND + 0.5)
    with pytest.raises(Singular) as jumped:
        inverse.follow(np.stack([first, second]), BEND)
    assert jumped.value.sample == 1
    with pytest.raises(StartsElsewhere):
        inverse.follow(second[None], BEND)
    with pytest.raises(LimitReached) as beyond:
        seven(1.0).follow(first[None], BEND)
    assert (beyond.value.sample, beyond.value.joint, beyond.value.bound) == (0, 3, -1.0)


def test_fewer_joints_than_a_pose_has_freedoms() -> None:
    inverse = NumericInverse(Arm(Pose(), chain_of_rows(SEVEN[:4])), [-3.0] * 4, [3.0] * 4)
    pose = inverse.arm.placement(BEND[:4])
    found = inverse.solve(pose, BEND[:4] + 0.1)
    assert found.reached
    assert max(distances(inverse.arm.placement(found.angles), pose)) < POLISHED
    pose[:3, 3] += [0.05, 0.0, 0.0]
    assert not inverse.solve(pose, BEND[:4]).reached
