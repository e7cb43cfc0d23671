"""The closed form: all branches, the singular configurations, angles and limits."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.chain import chain_of_rows
from axisync_robot.poses import distances, pose_of
from axisync_robot.ur_inverse import Solutions, UrInverse
from axisync_robot.ur_inverse_geometry import UrGeometry, ur_arm
from axisync_schemas.cell import Group, Pose
from support.arms import arm_of, cell, rows_of, solver

Array = NDArray[np.float64]
GROUPS = cell().groups
TOOL = Pose.model_validate({"position_m": (0.02, -0.03, 0.15), "rpy_deg": (20.0, -30.0, 50.0)})
EXACT = 1e-9

SINGULAR = {
    "zero": [0, 0, 0, 0, 0, 0],
    "home": [0, -90, 0, -90, 0, 0],
    "home turned": [35, -90, 0, -90, 0, 20],
    "wrist": [10, -70, 80, -20, 0, 30],
    "wrist back": [10, -70, 80, -20, 180, 30],
    "elbow": [10, -70, 0, -20, 50, 30],
    "folded": [10, -70, 180, -20, 50, 30],
    "elbow and wrist": [10, -70, 0, -20, 0, 30],
    "folded and wrist": [10, -70, 180, -20, 180, 30],
    "paper's P1": [0, -150, 60, -45, -45, 45],
}


def closest(found: Solutions, q: Array) -> Array:
    """[k]: largest joint difference from q [k, 6] to the nearest reachable branch."""
    off = np.abs(found.angles - q[:, None]).max(axis=-1)
    return np.where(found.reachable, off, np.inf).min(axis=1)


def assert_exact(inverse: UrInverse, poses: Array, found: Solutions) -> None:
    every = np.broadcast_to(poses[:, None], (len(poses), 8, 4, 4))
    apart, turn = distances(inverse.forward(found.angles[found.reachable]), every[found.reachable])
    assert apart.max() < EXACT
    assert turn.max() < EXACT
    assert np.isnan(found.angles[~found.reachable]).all()


@pytest.mark.parametrize("group", GROUPS, ids=lambda g: g.name)
class TestBothArms:
    def test_forward_agrees_with_pinocchio(self, group: Group) -> None:
        inverse, arm = solver(group), arm_of(group)
        q = np.random.default_rng(1).uniform(-math.pi, math.pi, (100, 6))
        expected = np.stack([arm.placement(row) for row in q])
        assert np.abs(inverse.forward(q) - expected).max() < 1e-12

    def test_every_branch_reaches_and_ours_is_among_them(self, group: Group) -> None:
        inverse = solver(group)
        q = np.random.default_rng(2).uniform(-math.pi, math.pi, (5000, 6))
        poses = inverse.forward(q)
        found = inverse.solve(poses, q)
        assert_exact(inverse, poses, found)
        assert closest(found, q).max() < 1e-7
        # Branches come in pairs at least: elbow up and down.
        assert (found.reachable.sum(axis=1) >= 2).all()
        assert (found.reachable.sum(axis=1) == 8).mean() > 0.5

    def test_the_index_tells_elbow_and_wrist(self, group: Group) -> None:
        inverse = solver(group)
        poses = inverse.forward(np.random.default_rng(8).uniform(-math.pi, math.pi, (1000, 6)))
        found = inverse.solve(poses, np.zeros(6))
        plain = found.angles
        assert (plain[:, [0, 1, 4, 5], 2] >= 0.0)[found.reachable[:, [0, 1, 4, 5]]].all()
        assert (plain[:, ::2, 4] >= 0.0)[found.reachable[:, ::2]].all()

    @pytest.mark.parametrize("name", SINGULAR)
    def test_singular_configurations_are_found(self, group: Group, name: str) -> None:
        inverse = solver(group)
        q = np.radians([SINGULAR[name]])
        poses = inverse.forward(q)
        found = inverse.solve(poses, q)
        assert_exact(inverse, poses, found)
        # At a fold the angle is the square root of the distance's rounding.
        assert closest(found, q).max() < 1e-6
        assert found.free.any() == (SINGULAR[name][4] % 180 == 0)

    @pytest.mark.parametrize("name", SINGULAR)
    def test_no_reference_loses_the_pose(self, group: Group, name: str) -> None:
        inverse = solver(group)
        poses = np.repeat(inverse.forward(np.radians([SINGULAR[name]])), 500, axis=0)
        found = inverse.solve(poses, np.random.default_rng(3).uniform(-math.pi, math.pi, (500, 6)))
        assert found.reachable.any(axis=1).all()
        assert_exact(inverse, poses, found)

    def test_right_angles(self, group: Group) -> None:
        inverse = solver(group)
        q = np.random.default_rng(4).integers(-2, 3, (3000, 6)) * (math.pi / 2)
        poses = inverse.forward(q)
        found = inverse.solve(poses, q)
        assert_exact(inverse, poses, found)
        assert closest(found, q).max() < 1e-6


def test_a_singular_wrist_keeps_the_reference_s_last_joint() -> None:
    inverse = solver(GROUPS[0])
    q = np.radians([10.0, -70.0, 80.0, -20.0, 0.0, 30.0])
    pose = inverse.forward(q)[None]
    for last in (-2.0, 0.3, 1.2):
        found = inverse.solve(pose, np.array([*q[:5], last]))
        off = np.abs(found.angles[0, :, 5] - last)[found.free[0] & found.reachable[0]]
        assert off.min() < 1e-12


def test_angles_are_nearest_the_reference() -> None:
    inverse = solver(GROUPS[0], 20.0)
    q = np.random.default_rng(5).uniform(-12.0, 12.0, (500, 6))
    found = inverse.solve(inverse.forward(q), q)
    assert closest(found, q).max() < 1e-7
    off = np.abs(found.angles - q[:, None])
    assert np.nanmax(off) <= math.pi + 1e-9


def test_limits_choose_the_turn_or_say_that_none_fits() -> None:
    group = GROUPS[0]
    inverse = solver(group, math.radians(170.0))
    pose = inverse.forward(np.radians([[10.0, -70.0, 80.0, -20.0, 50.0, 30.0]]))
    far = inverse.solve(pose, np.full(6, 6.0))
    inside = (np.abs(far.angles) <= math.radians(170.0)).all(axis=-1)
    assert np.array_equal(far.within, inside & far.reachable)
    assert far.within.any()
    q = np.radians([[10.0, -70.0, 80.0, -20.0, 50.0, 175.0]])
    found = inverse.solve(inverse.forward(q), q)
    branch = int(np.nanargmin(np.abs(found.angles[0] - q).max(axis=-1)))
    assert found.reachable[0, branch]
    assert not found.within[0, branch]


def test_out_of_reach_has_no_branch_and_a_reference_for_each_pose_counts() -> None:
    inverse = solver(GROUPS[0])
    q = np.radians([[10.0, -70.0, 80.0, -20.0, 50.0, 30.0]])
    poses = np.concatenate([inverse.forward(q), pose_of([[3.0, 0.0, 0.0]], np.eye(3))])
    found = inverse.solve(poses, np.concatenate([q, q]))
    assert found.reachable[0].any()
    assert not found.reachable[1].any()


def test_stretched_within_rounding_is_reached_and_beyond_is_not() -> None:
    inverse = solver(GROUPS[0])
    q = np.radians([10.0, -70.0, 0.0, -20.0, 50.0, 30.0])
    pose = inverse.forward(q)
    g, c1, s1 = inverse.geometry, math.cos(q[0]), math.sin(q[0])
    along = math.copysign(1.0, g.a2) * np.array([math.cos(q[1]) * c1, math.cos(q[1]) * s1, math.sin(q[1])])
    outward = inverse.base[:3, :3] @ along
    counts = []
    for beyond in (5e-11, 1e-8):
        moved = pose.copy()
        moved[:3, 3] += beyond * outward
        found = inverse.solve(moved[None], q)
        off = np.abs(found.angles[0, :, 1] - q[1])[found.reachable[0]]
        counts.append(int((off < 1e-3).sum()))
    assert counts[0] >= 1
    assert counts[1] == 0


def test_bad_poses() -> None:
    inverse = solver(GROUPS[0])
    for poses in (np.eye(4), np.full((2, 4, 4), np.nan), np.zeros((3, 3, 3))):
        with pytest.raises(ValueError, match="finite poses"):
            inverse.solve(poses, np.zeros(6))


def test_only_this_geometry_is_taken() -> None:
    rows = rows_of(GROUPS[1])
    found = ur_arm(chain_of_rows(rows))
    assert found is not None
    geometry = found.geometry
    assert (geometry.d1, geometry.a2, geometry.a3) == (0.1135, -0.425, -0.3749)
    assert geometry.theta == (0.0,) * 6
    assert np.array_equal(found.base, np.eye(4))
    assert np.array_equal(found.flange, np.eye(4))
    assert ur_arm(chain_of_rows(rows[:5])) is None
    for index, change in ((0, {"alpha": 0.1}), (1, {"alpha": 1e-9}), (3, {"a": 0.01}), (2, {"a": 0.0})):
        others = [row.model_copy(update=change) if i == index else row for i, row in enumerate(rows)]
        assert ur_arm(chain_of_rows(others)) is None


def test_offsets_along_parallel_axes_and_theta_and_the_other_signs() -> None:
    group = GROUPS[0]
    changes: list[dict[str, float]] = [{"theta": 0.3}, {"d": 0.02, "a": 0.3}, {"d": -0.05}, {"d": -0.07, "theta": -0.4}]
    axes = list(group.axes)
    for i, change in enumerate([*changes, {"d": -0.09}]):
        row = axes[i].dh
        assert row is not None
        axes[i] = axes[i].model_copy(update={"dh": row.model_copy(update=change)})
    other = group.model_copy(update={"axes": tuple(axes)})
    inverse, arm = solver(other), arm_of(other)
    q = np.random.default_rng(6).uniform(-math.pi, math.pi, (500, 6))
    q[:100, 4] = 0.0
    assert np.abs(inverse.forward(q[:20]) - np.stack([arm.placement(row) for row in q[:20]])).max() < 1e-12
    poses = inverse.forward(q)
    found = inverse.solve(poses, q)
    assert_exact(inverse, poses, found)
    assert closest(found, q).max() < 1e-7


def test_equal_links_folded_onto_each_other_keep_the_reference_s_shoulder() -> None:
    """The wrist's centre stands at the shoulder: q2 turns nothing but the elbow."""
    geometry = UrGeometry(0.1, 0.5, 0.5, 0.09, 0.11, 0.05, (0.0,) * 6)
    inverse = UrInverse(geometry, np.eye(4), np.full(6, -4.0), np.full(6, 4.0))
    q = np.array([[0.2, 0.4, math.pi, 0.7, 0.9, -0.3], [0.2, -1.4, -math.pi, 0.7, -0.9, -0.3]])
    poses = inverse.forward(q)
    found = inverse.solve(poses, q)
    assert_exact(inverse, poses, found)
    assert closest(found, q).max() < 1e-6


def test_with_a_tool_every_branch_puts_the_tool_there() -> None:
    group = GROUPS[0].model_copy(update={"tool": TOOL})
    inverse, arm = solver(group), arm_of(group)
    q = np.random.default_rng(9).uniform(-math.pi, math.pi, (1000, 6))
    poses = arm.placements(q)
    assert np.abs(inverse.forward(q) - poses).max() < 1e-12
    found = inverse.solve(poses, q)
    assert_exact(inverse, poses, found)
    assert closest(found, q).max() < 1e-7
