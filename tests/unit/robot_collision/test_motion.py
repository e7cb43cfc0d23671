"""Capsules at many poses against one pose at a time, and the bound on how far a joint's turn carries them."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.chain import chain_of_rows
from axisync_robot.collision_distance import segment_to_segment
from axisync_robot.collision_motion import ArmSegments, pair_reach
from axisync_robot.collision_shapes import Shapes
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]

pytestmark = pytest.mark.usefixtures("each_backend")


def test_segments_end_where_forward_kinematics_says(cell: Cell) -> None:
    rng = np.random.default_rng(3)
    for number, group in enumerate(cell.groups):
        shapes, rows = Shapes.of(cell), [axis.dh for axis in group.axes if axis.dh is not None]
        capsules = [c for c in shapes.capsules if c.group == number]
        q = rng.uniform(-math.pi, math.pi, (20, 6))
        ends = ArmSegments(group.base, shapes.chain(number), capsules).at(q)
        for links in range(1, 7):
            shorter = Arm(group.base, chain_of_rows(rows[:links]))
            tips = np.array([shorter.placement(pose[:links])[:3, 3] for pose in q])
            (at,) = (i for i, c in enumerate(capsules) if c.joint == links - 1)
            assert np.abs(ends[:, at, 1] - tips).max() < 1e-12


def arm_distances(cell: Cell, shapes: Shapes, q: Array) -> Array:
    """[m, p] between the segments of every pair of capsules."""
    ends = [
        ArmSegments(group.base, shapes.chain(g), [c for c in shapes.capsules if c.group == g]).at(q[:, axes])
        for g, group in enumerate(cell.groups)
        for axes in [list(cell.axis_indices(group.name))]
    ]
    first, second = shapes.pairs[shapes.pairs[:, 1] < len(shapes.capsules)].T
    every = np.concatenate(ends, axis=1)
    flat = segment_to_segment(every[:, first].reshape(-1, 2, 3), every[:, second].reshape(-1, 2, 3))
    return flat.reshape(len(q), -1)


def test_no_turn_changes_a_distance_by_more_than_the_reach_says(cell: Cell) -> None:
    shapes = Shapes.of(cell)
    reach = pair_reach(shapes)[shapes.pairs[:, 1] < len(shapes.capsules)]
    rng = np.random.default_rng(4)
    q = rng.uniform(-math.pi, math.pi, (400, 12))
    turned = q + rng.uniform(-0.3, 0.3, q.shape) * (rng.random(q.shape) < 0.3)
    change = np.abs(arm_distances(cell, shapes, turned) - arm_distances(cell, shapes, q))
    bound = np.abs(turned - q) @ reach.T
    assert (change <= bound + 1e-12).all()
    assert (change / np.maximum(bound, 1e-9)).max() > 0.8  # the bound is not idle


def test_joints_that_carry_both_links_do_not_count(cell: Cell) -> None:
    shapes = Shapes.of(cell)
    reach = pair_reach(shapes)
    names = [(shapes.words[i], shapes.words[j]) for i, j in shapes.pairs]
    row = reach[names.index(("kingkong link 3", "kingkong link 5"))]
    assert np.flatnonzero(row).tolist() == [3]  # joint 5 turns link 5 about the very segment that wraps it
    assert row[3] == 0.1103  # joint 4 turns about the offset of 0.0928, which therefore adds nothing
