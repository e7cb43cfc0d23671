"""What is drawn is where the arm's model says: two independent ways from the cell file to a tool."""

import numpy as np
import pytest

from axisync_dashboard.kinematics import BONE, arms_of
from axisync_robot.arm import Arm
from axisync_schemas.cell import Cell, read_cell
from support.arms import EOD

CELL: Cell = read_cell(EOD)[0]
RANDOM = np.random.default_rng(8)


@pytest.mark.parametrize("group", range(2))
def test_the_tool_is_drawn_where_the_robots_model_has_it(group: int) -> None:
    drawn, model = arms_of(CELL)[group], Arm.of(CELL.groups[group])
    assert drawn is not None
    assert model is not None
    angles = RANDOM.uniform(-3, 3, (20, 6))
    expected = np.stack([model.placement(row) for row in angles])
    np.testing.assert_allclose(drawn.tool_poses(angles), expected, atol=1e-12)


def test_links_have_the_capsules_of_the_cell_file() -> None:
    arm = arms_of(CELL)[0]
    assert arm is not None
    first, second = arm.links[0].capsules, arm.links[1].capsules
    assert first == (((0.0, 0.0, 0.0), (0.0, 0.0, 0.1135), 0.035),)
    assert second == (((0.0, 0.0, 0.0), (-0.2436, 0.0, 0.0), 0.035),)


def test_links_without_a_shape_are_drawn_thin_and_arms_without_dh_rows_not_at_all() -> None:
    group = CELL.groups[0]
    bare = tuple(axis.model_copy(update={"radius": None}) for axis in group.axes)
    flat = tuple(axis.model_copy(update={"dh": None}) for axis in group.axes)
    cells = [CELL.model_copy(update={"groups": (group.model_copy(update={"axes": axes}),)}) for axes in (bare, flat)]
    (thin,), (none,) = map(arms_of, cells)
    assert thin is not None
    assert thin.links[0].capsules[0][2] == BONE
    assert none is None
