"""The two arms of the demo cell and their solvers."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.inverse import inverse_of
from axisync_robot.poses import pose_of
from axisync_robot.ur_inverse import UrInverse
from axisync_schemas.cell import Cell, DenavitHartenberg, Group, parse_cell, read_cell
from axisync_schemas.cell_text import with_files

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
    found = inverse_of(arm_of(group), [-limit] * 6, [limit] * 6)
    assert isinstance(found, UrInverse)
    return found


def line(start: Array, end: Array, count: int) -> Array:
    """[count, 4, 4]: straight, with the orientation of the start."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    return pose_of(start[:3, 3] + share * (end[:3, 3] - start[:3, 3]), start[:3, :3])


def down(x: float, y: float, z: float) -> Array:
    return pose_of([x, y, z], DOWN)


URDF = Path(__file__).parent / "urdf"
ELBOW_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
OFFSET_JOINTS = tuple(f"joint_{i}" for i in range(1, 7))


def urdf_cell_text(file: str, joints: Sequence[str], more: str = "", base: str = "base_link") -> str:
    """A cell file of one group whose chain comes from a URDF file."""
    axes = "".join(
        f"""
[[groups.axes]]
name = "a{number}"
joint = "{joint}"
drive = {{ node_id = {number} }}
"""
        for number, joint in enumerate(joints, 1)
    )
    return f"""schema = 1
name = "one"
period_ms = 2.0

[[buses]]
name = "can"
interface = "simcan"
channel = "can"

[[groups]]
name = "arm"
urdf = {{ file = "{file}", base = "{base}", tip = "tool0" }}
{more}

[groups.defaults]
soft_limits_deg = [-170, 170]
hard_limits_deg = [-175, 175]
limits = {{ velocity_deg_s = 30, acceleration_deg_s2 = 40, jerk_deg_s3 = 80 }}
stop_limits = {{ acceleration_deg_s2 = 60, jerk_deg_s3 = 240 }}

[groups.defaults.drive]
bus = "can"
counts_per_turn = 1048576
following_error_max_deg = 2.0
quick_stop_deceleration_deg_s2 = 90
brake_release_ms = 60
identity = {{ vendor_id = 1, product_code = 1 }}
{axes}"""


def urdf_cell(file: str, joints: Sequence[str], more: str = "", base: str = "base_link") -> Cell:
    return parse_cell(with_files(urdf_cell_text(file, joints, more, base), URDF))
