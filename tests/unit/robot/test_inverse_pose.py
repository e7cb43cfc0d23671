"""The configuration of a single pose."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.chain import chain_of_rows
from axisync_robot.inverse import inverse_of
from axisync_robot.inverse_errors import LimitReached, Unreachable
from axisync_robot.inverse_pose import solve_pose
from axisync_robot.poses import distances, pose_of
from axisync_schemas.cell import DenavitHartenberg, Pose
from support.arms import arm_of, cell, solver

Array = NDArray[np.float64]
ARM = arm_of(cell().groups[1])
EVEN = np.ones(6)
BENT = np.radians([20.0, -70.0, -80.0, -30.0, 60.0, 40.0])


def test_it_is_there_and_no_other_is_sooner() -> None:
    rng = np.random.default_rng(4)
    inverse = solver(cell().groups[1])
    for _ in range(30):
        start, there = rng.uniform(-2.5, 2.5, (2, 6))
        speeds = rng.uniform(0.2, 2.0, 6)
        pose = ARM.placement(there)
        found = solve_pose(inverse, pose, start, speeds)
        apart, turn = distances(ARM.placement(found), pose)
        assert max(float(apart), float(turn)) < 1e-9
        every = inverse.solve(pose[np.newaxis], start)
        times = (np.abs(every.angles[0][every.within[0]] - start) / speeds).max(axis=1)
        assert (np.abs(found - start) / speeds).max() == pytest.approx(times.min(), abs=1e-9)


def test_speeds_decide_between_configurations() -> None:
    inverse = solver(cell().groups[1])
    rng = np.random.default_rng(7)
    differ = 0
    for _ in range(40):
        start, there = rng.uniform(-2.5, 2.5, (2, 6))
        pose = ARM.placement(there)
        slow_wrist, slow_base = np.array([9.0, 9, 9, 1, 1, 1]), np.array([1.0, 1, 1, 9, 9, 9])
        one, two = (solve_pose(inverse, pose, start, speeds) for speeds in (slow_wrist, slow_base))
        differ += bool(np.abs(one - two).max() > 1e-3)
    assert differ > 3


def test_where_it_stands_already_nothing_moves() -> None:
    found = solve_pose(solver(cell().groups[1]), ARM.placement(BENT), BENT, EVEN)
    assert np.abs(found - BENT).max() < 1e-9


def test_turns_are_taken_as_the_limits_allow() -> None:
    """The same angle a turn off is nearer, and beyond the limits."""
    start = BENT.copy()
    start[5] = 3.0
    there = BENT.copy()
    there[5] = -3.0
    pose = ARM.placement(there)
    wide = solve_pose(solver(cell().groups[1], math.tau), pose, start, EVEN)
    assert wide[5] == pytest.approx(math.tau - 3.0, abs=1e-9)
    narrow = solve_pose(solver(cell().groups[1], math.pi), pose, start, EVEN)
    assert np.abs(narrow).max() <= math.pi
    assert np.abs(ARM.placement(narrow) - pose).max() < 1e-9
    assert np.abs(narrow - start).max() > np.abs(wide - start).max()


def test_out_of_reach_has_the_nearest_pose() -> None:
    pose = pose_of([3.0, 0.0, 0.3], np.eye(3))
    with pytest.raises(Unreachable) as caught:
        solve_pose(solver(cell().groups[1]), pose, BENT, EVEN)
    nearest = caught.value.nearest
    assert np.linalg.norm(nearest[:3, 3] - pose[:3, 3]) == pytest.approx(caught.value.distance, abs=1e-9)
    reached = solve_pose(solver(cell().groups[1]), nearest, BENT, EVEN)
    assert np.abs(ARM.placement(reached) - nearest).max() < 1e-6


def test_within_no_limits() -> None:
    with pytest.raises(LimitReached) as caught:
        solve_pose(solver(cell().groups[1], 0.5), ARM.placement(BENT), np.zeros(6), EVEN)
    assert abs(caught.value.bound) == 0.5
    assert abs(caught.value.value) > 0.5


def seven() -> Arm:
    rows = [
        DenavitHartenberg.model_validate({"d_m": d, "a_m": 0.0, "alpha_deg": alpha})
        for d, alpha in ((0.34, -90), (0.0, 90), (0.4, 90), (0.0, -90), (0.4, -90), (0.0, 90), (0.126, 0))
    ]
    return Arm(Pose(), chain_of_rows(rows))


def test_other_arms_numerically() -> None:
    arm = seven()
    inverse = inverse_of(arm, [-2.9] * 7, [2.9] * 7)
    start = np.array([0.2, 0.6, -0.3, -1.2, 0.4, 0.9, 0.1])
    there = start + 0.2
    found = solve_pose(inverse, arm.placement(there), start, np.ones(7))
    apart, turn = distances(arm.placement(found), arm.placement(there))
    assert max(float(apart), float(turn)) < 1e-8
    with pytest.raises(Unreachable) as caught:
        solve_pose(inverse, pose_of([0.0, 3.0, 0.3], np.eye(3)), start, np.ones(7))
    assert caught.value.distance > 1.0
