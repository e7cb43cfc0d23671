"""The inverse kinematics of an arm: closed form where its geometry allows, numeric otherwise."""

from numpy.typing import ArrayLike

from axisync_robot.arm import Arm
from axisync_robot.inverse_path import STEP_MAX, Followed, follow_branch
from axisync_robot.numeric_inverse import NumericInverse
from axisync_robot.ur_inverse import UrInverse
from axisync_robot.ur_inverse_geometry import ur_arm

Inverse = UrInverse | NumericInverse


def inverse_of(arm: Arm, low: ArrayLike, high: ArrayLike) -> Inverse:
    """The solver for this arm within joint limits low, high [n], rad."""
    found = ur_arm(arm.chain)
    if found is None:
        return NumericInverse(arm, low, high)
    return UrInverse(found.geometry, arm.base @ found.base, low, high, found.flange @ arm.tool)


def follow(inverse: Inverse, poses: ArrayLike, start: ArrayLike, step_max: float = STEP_MAX) -> Followed:
    """Joint angles [k, n] along poses [k, 4, 4] in O, continuous from start [n], rad.

    Raises:
        PathRefused: the sample at which the arm cannot go on, and why (axisync_robot.inverse_errors).
    """
    if isinstance(inverse, UrInverse):
        return follow_branch(inverse, poses, start, step_max)
    return inverse.follow(poses, start, step_max)
