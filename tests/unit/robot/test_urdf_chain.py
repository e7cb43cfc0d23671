"""Arms from URDF files: where their tool is, which solver they get, what shapes they have."""

import math

import numpy as np
import pinocchio
import pytest
from numpy.typing import NDArray

from axisync_robot.arm import Arm, chain_of
from axisync_robot.chain import Chain
from axisync_robot.collision import CollisionModel
from axisync_robot.collision_pose import PoseChecker
from axisync_robot.collision_shapes import Shapes
from axisync_robot.inverse import follow, inverse_of
from axisync_robot.numeric_inverse import NumericInverse
from axisync_robot.poses import distances
from axisync_robot.ur_inverse import UrInverse
from axisync_robot.ur_inverse_geometry import ur_arm
from axisync_schemas.cell import Cell, Pose
from support.arms import ELBOW_JOINTS, OFFSET_JOINTS, URDF, arm_of, cell, line, urdf_cell

Array = NDArray[np.float64]
TOOL = "tool = { position_m = [0.02, -0.03, 0.15], rpy_deg = [20, -30, 50] }"
BEND = np.array([0.3, -0.4, 0.9, -0.5, 0.7, 0.2])


def elbow(more: str = "", base: str = "base_link") -> Cell:
    return urdf_cell("elbow_arm.urdf", ELBOW_JOINTS, more, base)


def offset(more: str = "") -> Cell:
    return urdf_cell("offset_wrist.urdf", OFFSET_JOINTS, more)


def tip_by_pinocchio(name: str, q: Array, base: str, joints: tuple[str, ...]) -> Array:
    """Its own reading of the whole file, each joint by name; cosine and sine for continuous ones."""
    model = pinocchio.buildModelFromUrdf(str(URDF / name))
    data, full = model.createData(), pinocchio.neutral(model)
    for joint, angle in zip(joints, q, strict=True):
        number = model.getJointId(joint)
        at = model.idx_qs[number]
        full[at : at + model.nqs[number]] = [math.cos(angle), math.sin(angle)] if model.nqs[number] == 2 else [angle]
    pinocchio.framesForwardKinematics(model, data, full)
    first, last = (data.oMf[model.getFrameId(link)] for link in (base, "tool0"))
    pose: Array = first.actInv(last).homogeneous
    return pose


def test_the_same_arm_as_its_dh_table() -> None:
    ours, theirs = Arm(Pose(), chain_of_group(elbow())), Arm(Pose(), chain_of_group(cell()))
    for q in np.random.default_rng(1).uniform(-math.pi, math.pi, (100, 6)):
        assert np.abs(ours.placement(q) - theirs.placement(q)).max() < 1e-12


def chain_of_group(of: Cell) -> Chain:
    chain = chain_of(of.groups[0])
    assert chain is not None
    return chain


@pytest.mark.parametrize("base", ["base_link", "world"])
def test_every_axis_direction_as_pinocchio_reads_it(base: str) -> None:
    for name, joints, made in (
        ("elbow_arm.urdf", ELBOW_JOINTS, elbow(base=base)),
        ("offset_wrist.urdf", OFFSET_JOINTS, offset()),
    ):
        link = base if name == "elbow_arm.urdf" else "base_link"
        arm = arm_of(made.groups[0])
        q = np.random.default_rng(2).uniform(-math.pi, math.pi, (30, 6))
        expected = np.stack([tip_by_pinocchio(name, row, link, joints) for row in q])
        # The rounded right angles of the file, 2e-10 rad each, are taken as right ones.
        bound = 1e-9 if name == "elbow_arm.urdf" else 1e-12
        assert np.abs(arm.placements(q) - expected).max() < bound
        assert np.abs(arm.placements(q) - np.stack([arm.placement(row) for row in q])).max() < 1e-14


def test_its_geometry_takes_the_closed_form_with_a_tool_too() -> None:
    arm = arm_of(elbow(TOOL).groups[0])
    inverse = inverse_of(arm, [-3.0] * 6, [3.0] * 6)
    assert isinstance(inverse, UrInverse)
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (500, 6))
    poses = arm.placements(q)
    assert np.abs(inverse.forward(q) - poses).max() < 1e-12
    found = inverse.solve(poses, q)
    off = np.where(found.reachable, np.abs(found.angles - q[:, None]).max(axis=-1), np.inf)
    assert off.min(axis=1).max() < 1e-7
    again = arm.placements(found.angles[found.reachable])
    apart, turn = distances(again, np.repeat(poses, found.reachable.sum(axis=1), axis=0))
    assert max(apart.max(), turn.max()) < 1e-9


@pytest.mark.parametrize("turned", [(2,), (3,), (2, 3), (0, 1, 2, 3, 4, 5)])
def test_axes_that_point_the_other_way_keep_the_closed_form(turned: tuple[int, ...]) -> None:
    """Rx(pi) Rz(q) Rx(pi) = Rz(-q): the same arm with some angles counted backwards."""
    chain = chain_of_group(elbow())
    joints, flange, flip = chain.joints.copy(), chain.flange.copy(), np.diag([1.0, -1.0, -1.0, 1.0])
    for joint in turned:
        joints[joint] = joints[joint] @ flip
        if joint < 5:
            joints[joint + 1] = flip @ joints[joint + 1]
        else:
            flange = flip @ flange
    other = Chain(joints, flange, chain.links)
    found = ur_arm(other)
    assert found is not None
    arm, sign = Arm(Pose(), other), np.ones(6)
    sign[list(turned)] = -1.0
    q = np.random.default_rng(4).uniform(-3.0, 3.0, (50, 6))
    assert np.abs(arm.placements(q) - Arm(Pose(), chain).placements(sign * q)).max() < 1e-12
    inverse = inverse_of(arm, [-3.2] * 6, [3.2] * 6)
    assert isinstance(inverse, UrInverse)
    assert np.abs(inverse.forward(q) - arm.placements(q)).max() < 1e-12
    solved = inverse.solve(arm.placements(q), q)
    off = np.where(solved.within, np.abs(solved.angles - q[:, None]).max(axis=-1), np.inf)
    assert off.min(axis=1).max() < 1e-7


def test_an_offset_wrist_is_followed_numerically() -> None:
    arm = arm_of(offset(TOOL).groups[0])
    inverse = inverse_of(arm, [-3.0] * 6, [3.0] * 6)
    assert isinstance(inverse, NumericInverse)
    end = arm.placement(BEND)
    end[:3, 3] += [0.05, -0.06, 0.04]
    poses = line(arm.placement(BEND), end, 200)
    found = follow(inverse, poses, BEND).angles
    apart, turn = distances(arm.placements(found), poses)
    assert max(apart.max(), turn.max()) < 1e-13


def test_shapes_are_capsules_around_the_file_s() -> None:
    shapes = Shapes.of(elbow())
    by_name = {c.name: c for c in shapes.capsules}
    # The mesh and the base's box are left out; the flange hangs on the last joint.
    assert set(by_name) == {"a1", "a2", "a3", "a6"}
    assert by_name["a2"].radius == 0.035
    assert by_name["a3"].radius == pytest.approx(0.025)
    assert np.abs(by_name["a3"].end - by_name["a3"].start) == pytest.approx([0.26, 0.0, 0.0])
    sphere = by_name["a6"]
    assert np.array_equal(sphere.start, sphere.end)
    assert sphere.start == pytest.approx([0.0, 0.0, 0.06])


def test_shapes_are_where_pinocchio_puts_the_links() -> None:
    of = elbow()
    shapes = Shapes.of(of)
    chain = shapes.chain(0)
    model = pinocchio.buildModelFromUrdf(str(URDF / "elbow_arm.urdf"))
    data, full = model.createData(), pinocchio.neutral(model)
    frames = list(chain.frames(np.zeros((1, 6)), np.eye(4)))
    pinocchio.framesForwardKinematics(model, data, full)
    base = data.oMf[model.getFrameId("base_link")]
    for name, link, middle in (("a2", "upper_arm", [-0.1218, 0, 0]), ("a6", "flange", [0, 0, 0.01])):
        capsule = next(c for c in shapes.capsules if c.name == name)
        axes, origin = frames[capsule.joint]
        ours = origin[:, 0] + axes[:, :, 0].T @ (capsule.start + capsule.end) / 2.0
        theirs = base.actInv(data.oMf[model.getFrameId(link)]).act(np.array(middle, dtype=np.float64))
        assert np.abs(ours - theirs).max() < 1e-9


def test_a_radius_wraps_the_way_to_the_next_joint_and_both_checkers_agree() -> None:
    made = offset().model_dump(by_alias=True)
    for axis in made["groups"][0]["axes"]:
        axis["radius_m"] = 0.02
    made["geometry"]["boxes"] = ({"name": "table", "size_m": (2.0, 2.0, 0.02)},)
    of = Cell.model_validate(made)
    shapes = Shapes.of(of)
    assert len(shapes.capsules) == 6
    chain = shapes.chain(0)
    for capsule in shapes.capsules:
        assert np.array_equal(capsule.end, chain.ways[capsule.joint])
    model, single = CollisionModel(of), PoseChecker(shapes)
    for q in np.random.default_rng(5).uniform(-1.5, 1.5, (20, 6)):
        near = model.check_path(q[None], margin=0.0).nearest
        assert near is not None
        distance, _ = single.nearest(q)
        if distance > 0.0:
            assert near.distance == pytest.approx(distance, abs=1e-6)


def test_capsules_of_the_cell_file_are_in_the_link_s_frame_and_replace_the_file_s() -> None:
    made = elbow().model_dump(by_alias=True)
    made["groups"][0]["axes"][1]["capsules"] = (
        {"from_m": (0.0, 0.01, 0.0), "to_m": (-0.2, 0.01, 0.0), "radius_m": 0.01},
    )
    (capsule,) = (c for c in Shapes.of(Cell.model_validate(made)).capsules if c.name == "a2")
    # upper_arm turns about its -y.
    assert capsule.radius == 0.01
    assert capsule.start[2] == pytest.approx(-0.01)
    assert np.linalg.norm(capsule.end - capsule.start) == pytest.approx(0.2)
