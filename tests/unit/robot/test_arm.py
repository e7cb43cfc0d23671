"""Forward kinematics against the plain product of DH matrices, and against the paper's pose."""

import ctypes
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.chain import chain_of_rows, rotation_x, rotation_y, rotation_z
from axisync_schemas.cell import Cell, DenavitHartenberg, Pose, read_cell

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def cell() -> Cell:
    found, _ = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
    return found


def rows_of(cell: Cell, group: int) -> list[DenavitHartenberg]:
    return [axis.dh for axis in cell.groups[group].axes if axis.dh is not None]


def product(base: Pose, rows: list[DenavitHartenberg], q: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll) and the position, then Rz(theta) Tz(d) Tx(a) Rx(alpha) of every row."""
    pose = np.eye(4)
    roll, pitch, yaw = base.rpy
    for c, s, i, j in (
        (math.cos(yaw), math.sin(yaw), 0, 1), (math.cos(pitch), -math.sin(pitch), 0, 2),
        (math.cos(roll), math.sin(roll), 1, 2),
    ):  # fmt: skip
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = c
        turn[i, j], turn[j, i] = -s, s
        pose = pose @ turn
    pose[:3, 3] = base.position
    for row, angle in zip(rows, q, strict=True):
        ct, st = math.cos(angle + row.theta), math.sin(angle + row.theta)
        ca, sa = math.cos(row.alpha), math.sin(row.alpha)
        pose = pose @ np.array(
            [[ct, -st * ca, st * sa, row.a * ct], [st, ct * ca, -ct * sa, row.a * st], [0, sa, ca, row.d], [0, 0, 0, 1]]
        )
    return pose


@pytest.mark.parametrize("group", [0, 1])
def test_forward_is_the_product_of_dh_matrices(cell: Cell, group: int) -> None:
    rows, base = rows_of(cell, group), cell.groups[group].base
    arm = Arm.of(cell.groups[group])
    assert arm is not None
    for q in np.random.default_rng(5).uniform(-math.pi, math.pi, (100, 6)):
        expected = product(base, rows, q)
        assert np.abs(arm.placement(q) - expected).max() < 1e-12
        (position, (x, y, z, w)) = arm.forward(q)
        assert np.abs(np.array(position) - expected[:3, 3]).max() < 1e-12
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        assert np.abs(rotation - expected[:3, :3]).max() < 1e-12
        assert w >= 0.0


def test_the_paper_s_pose(cell: Cell) -> None:
    arm = Arm(Pose(), chain_of_rows(rows_of(cell, 0)))
    pose = arm.placement(np.radians([-90, -150, 45, -90, -90, -90]))
    assert pose[:3, 3] == pytest.approx([-0.0928, -0.25277, 0.6108], abs=5e-5)
    r = pose[:3, :3]
    zyz = [math.atan2(r[1, 2], r[0, 2]), math.acos(r[2, 2]), math.atan2(r[2, 1], -r[2, 0])]
    assert abs(math.degrees(zyz[0]) - 90) < 1e-9
    assert abs(math.degrees(zyz[1]) - 75) < 1e-9
    assert abs(abs(math.degrees(zyz[2])) - 180) < 1e-9


def test_theta_offsets_and_a_base_turned_about_all_axes(cell: Cell) -> None:
    rows = [row.model_copy(update={"theta": 0.1 * i - 0.2}) for i, row in enumerate(rows_of(cell, 1))]
    base = Pose.model_validate({"position_m": (0.1, -0.2, 0.3), "rpy_deg": (10.0, 20.0, -30.0)})
    q = np.array([0.3, -1.0, 0.7, 2.0, -0.4, 1.1])
    assert np.abs(Arm(base, chain_of_rows(rows)).placement(q) - product(base, rows, q)).max() < 1e-12


def test_a_group_without_rows_has_no_arm(cell: Cell) -> None:
    group = cell.groups[0]
    bare = group.model_copy(update={"axes": (group.axes[0].model_copy(update={"dh": None}), *group.axes[1:])})
    assert Arm.of(bare) is None


def test_the_wrong_number_of_joints(cell: Cell) -> None:
    arm = Arm.of(cell.groups[0])
    assert arm is not None
    with pytest.raises(ValueError, match="6 joint angles"):
        arm.forward([0.0] * 5)


def test_right_angles_are_exact() -> None:
    for turn in (rotation_x, rotation_y, rotation_z):
        quarter = turn(math.pi / 2)
        assert set(np.abs(quarter).ravel().tolist()) == {0.0, 1.0}
        assert np.array_equal(quarter @ quarter @ quarter @ quarter, np.eye(3))
        assert np.array_equal(turn(-math.pi / 2), quarter.T)


TOOL = Pose.model_validate({"position_m": (0.02, -0.03, 0.15), "rpy_deg": (20.0, -30.0, 50.0)})


@pytest.mark.parametrize("group", [0, 1])
def test_a_tool_s_frame_follows_the_flange_s(cell: Cell, group: int) -> None:
    fitted = cell.groups[group].model_copy(update={"tool": TOOL})
    arm = Arm.of(fitted)
    assert arm is not None
    q = np.random.default_rng(6).uniform(-math.pi, math.pi, (100, 6))
    expected = np.stack([product(fitted.base, rows_of(cell, group), row) @ product(TOOL, [], q[:0]) for row in q])
    assert np.abs(np.stack([arm.placement(row) for row in q]) - expected).max() < 1e-12
    assert np.abs(arm.placements(q) - expected).max() < 1e-12
    pose, jacobian = arm.jacobian(q[0])
    for joint, step in enumerate(1e-6 * np.eye(6)):
        slope = (arm.placement(q[0] + step) - arm.placement(q[0] - step)) / 2e-6
        turn = slope[:3, :3] @ pose[:3, :3].T
        assert jacobian[:, joint] == pytest.approx([*slope[:3, 3], turn[2, 1], turn[0, 2], turn[1, 0]], abs=1e-8)


def test_placements_need_rows_of_angles(cell: Cell) -> None:
    arm = Arm.of(cell.groups[0])
    assert arm is not None
    with pytest.raises(ValueError, match="rows of 6 joint angles"):
        arm.placements([0.0] * 6)


class Mallinfo(ctypes.Structure):
    """glibc's `struct mallinfo2`."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks")),
        *((name, ctypes.c_size_t) for name in ("uordblks", "fordblks", "keepcost")),
    )


def test_a_pose_costs_no_memory_for_good(cell: Cell) -> None:
    """Front asks 20 times a second for as long as the service runs; tracemalloc would not see it."""
    mallinfo = getattr(ctypes.CDLL(None), "mallinfo2", None)
    if mallinfo is None:
        pytest.skip("mallinfo2 comes with glibc 2.33")
    mallinfo.restype = Mallinfo
    arm, q = Arm(cell.groups[0].base, chain_of_rows(rows_of(cell, 0))), np.full(6, 0.3)
    for ask in (arm.forward, arm.placement, arm.jacobian):
        ask(q)
        before = mallinfo().uordblks
        for _ in range(1000):
            ask(q)
        assert mallinfo().uordblks - before < 8000, ask.__name__
