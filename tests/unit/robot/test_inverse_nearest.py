"""The nearest reachable pose: reached, with the same orientation, and nothing nearer is."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.inverse_nearest import nearest_reachable
from axisync_schemas.cell import Pose
from support.arms import cell, down, solver

Array = NDArray[np.float64]
INVERSE = solver(cell().groups[0], math.radians(170.0))
TARGETS = {
    "far": (10.0, 0.0, 0.0),
    "just out": (-0.5, 0.4, 0.3),
    "inside the base": (0.07, 0.1373, 0.0894),
    "beside the shoulder": (0.07, 0.25, 0.15),
    "origin": (0.0, 0.0, 0.0),
}


@pytest.mark.parametrize("name", TARGETS)
def test_nothing_nearer_is_reached(name: str) -> None:
    target = down(*TARGETS[name])
    found = nearest_reachable(INVERSE, target, np.zeros(6))
    assert found is not None
    assert INVERSE.solve(found.pose[None], np.zeros(6)).within.any()
    assert np.array_equal(found.pose[:3, :3], target[:3, :3])
    moved = found.pose[:3, 3] - target[:3, 3]
    assert np.linalg.norm(moved) == pytest.approx(found.distance)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(4000, 3))
    directions[::2] = moved / found.distance + 0.05 * directions[::2]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    share = np.where(rng.random(4000) < 0.5, 1.0, rng.random(4000) ** (1 / 3))
    poses = np.repeat(target[None], 4000, axis=0)
    poses[:, :3, 3] += 0.999 * found.distance * share[:, None] * directions
    assert not INVERSE.solve(poses, np.zeros(6)).within.any()


def test_pulled_out_of_a_stretched_arm() -> None:
    """The stretched pose itself bounds the distance from above; the other branches gain a little."""
    inverse = solver(cell().groups[0])
    q = np.radians([10.0, -70.0, 0.0, -20.0, 90.0, 30.0])
    pose = inverse.forward(q)
    g = inverse.geometry
    along = math.copysign(1.0, g.a2) * np.array(
        [math.cos(q[1]) * math.cos(q[0]), math.cos(q[1]) * math.sin(q[0]), math.sin(q[1])]
    )
    target = pose.copy()
    target[:3, 3] += 0.5 * (inverse.base[:3, :3] @ along)
    found = nearest_reachable(inverse, target, q)
    assert found is not None
    assert found.distance <= 0.5 + 1e-9
    assert found.distance > 0.4


def test_a_reachable_pose_is_its_own_nearest() -> None:
    pose = down(-0.2719, 0.157, 0.3)
    found = nearest_reachable(INVERSE, pose, np.zeros(6))
    assert found is not None
    assert found.distance == 0.0
    assert np.array_equal(found.pose, pose)


def test_limits_that_leave_nothing() -> None:
    shut = solver(cell().groups[0], 1e-6)
    assert nearest_reachable(shut, down(-0.2719, 0.157, 0.3), np.zeros(6)) is None


def test_with_a_tool_the_tool_is_brought_near() -> None:
    tool = Pose.model_validate({"position_m": (0.0, 0.1, 0.3), "rpy_deg": (90.0, 0.0, 0.0)})
    group = cell().groups[0]
    bare, fitted = solver(group), solver(group.model_copy(update={"tool": tool}))
    target = down(-0.6, 0.5, 0.4)
    found = nearest_reachable(fitted, target, np.zeros(6))
    assert found is not None
    assert found.distance > 0.01
    assert fitted.solve(found.pose[None], np.zeros(6)).within.any()
    # The same search for the flange alone, where it would have to be.
    flange = nearest_reachable(bare, fitted.flange(target), np.zeros(6))
    assert flange is not None
    assert found.distance == pytest.approx(flange.distance, rel=1e-5)
