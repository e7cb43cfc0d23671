"""Where a move ends: joint values within soft limits, poses in the frames that requests use."""

import math
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.poses import (
    inverse_pose,
    pose_of,
    quaternion_of_rotation,
    rotation_of_quaternion,
    rotation_of_zyz,
)
from axisync_schemas.cell import Axis
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.moves import Frame, Orientation, ToolPose

Array = NDArray[np.float64]


def joint_target(axes: Sequence[Axis], values: Sequence[float], relative: bool, start: Array) -> Array:
    """[n] absolute joint values: for a relative move start + values, axis by axis.

    Raises:
        Refusal: INVALID_REQUEST (not one value for each axis), SOFT_LIMIT.
    """
    if len(values) != len(axes):
        message = f"move.target: {len(axes)} axes are expected, not {len(values)}"
        fault = {"path": "move.target", "message": message, "value": len(values)}
        raise Refusal(ErrorCode.INVALID_REQUEST, message, errors=[fault], axes=[axis.name for axis in axes])
    target = start + np.array(values) if relative else np.array(values)
    for axis, value in zip(axes, target.tolist(), strict=True):
        low, high = axis.soft_limits
        if not low <= value <= high:
            _refuse_target(axis, value, low if value < low else high)
    return target


def _refuse_target(axis: Axis, value: float, bound: float) -> NoReturn:
    message = (
        f"{axis.name}: target {math.degrees(value):.6g} deg is beyond the soft limit {math.degrees(bound):.6g} deg"
    )
    raise Refusal(
        ErrorCode.SOFT_LIMIT, message, axis=axis.name, value=value, bound=bound, limits=list(axis.soft_limits),
        nearest_allowed=bound,
    )  # fmt: skip


def placement_of(frame: Frame, arm: Arm, tool: Array) -> Array:
    """[4, 4] the frame that poses are given in, in O; `tool` [4, 4] is where the tool is when the move begins."""
    return {"base": arm.base, "body": np.eye(4), "tool": tool}[frame]


def rotation_of(orientation: Orientation, default: Array) -> Array:
    """[3, 3]; `default` where none is given."""
    if orientation.quaternion is not None:
        return rotation_of_quaternion(orientation.quaternion)
    if orientation.euler_zyz is not None:
        return rotation_of_zyz(orientation.euler_zyz)
    return default


def target_pose(pose: ToolPose, relative: bool, start: Array) -> Array:
    """[4, 4] in the frame that `start` [4, 4] is in: absolute, or that far along and about the frame's axes."""
    if not relative:
        return pose_of(pose.position, rotation_of(pose, start[:3, :3]))
    turned = rotation_of(pose, np.eye(3)) @ start[:3, :3]
    return pose_of(start[:3, 3] + np.array(pose.position), turned)


def in_words(pose: Array, frame: Array) -> dict[str, list[float]]:
    """A pose of O as a request writes it, in `frame` [4, 4]."""
    seen = inverse_pose(frame) @ pose
    return {"position": seen[:3, 3].tolist(), "quaternion": quaternion_of_rotation(seen[:3, :3]).tolist()}
