"""The two arms of the demo cell and their solvers."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import Arm, base_placement
from axisync_robot.poses import pose_of
from axisync_robot.ur_inverse import UrInverse
from axisync_robot.ur_inverse_geometry import ur_geometry
from axisync_schemas.cell import Cell, DenavitHartenberg, Group, read_cell

Array = NDArray[np.float64]

EOD = Path(__file__).parents[2] / "service" / "axisync_service" / "cells" / "eod.toml"
DOWN = np.diag([1.0, -1.0, -1.0])
"""The tool pointing down."""


def cell() -> Cell:
    return read_cell(EOD)[0]


def rows_of(group: Group) -> list[DenavitHartenberg]:
    return [axis.dh for axis in group.axes if axis.dh is not None]


def arm_of(group: Group) -> Arm:
    found = Arm.of(group)
    assert found is not None
    return found


def solver(group: Group, limit: float = math.tau) -> UrInverse:
    geometry = ur_geometry(rows_of(group))
    assert geometry is not None
    return UrInverse(geometry, base_placement(group.base).homogeneous, [-limit] * 6, [limit] * 6)


def line(start: Array, end: Array, count: int) -> Array:
    """[count, 4, 4]: straight, with the orientation of the start."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    return pose_of(start[:3, 3] + share * (end[:3, 3] - start[:3, 3]), start[:3, :3])


def down(x: float, y: float, z: float) -> Array:
    return pose_of([x, y, z], DOWN)
