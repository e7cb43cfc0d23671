"""The inverse kinematics of an arm: closed form where its geometry allows, numeric otherwise."""

import numpy as np
from numpy.typing import ArrayLike

from axisync_robot.arm import Arm
from axisync_robot.inverse_errors import LimitReached, PathRefused, Singular
from axisync_robot.inverse_path import STEP_MAX, Ended, Followed, follow_branch, follow_while
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


def follow_far(inverse: Inverse, poses: ArrayLike, start: ArrayLike) -> Followed:
    """As `follow`, but only as far as that goes: angles [m, n] of the first m <= k poses, and what ends them.

    Raises:
        PathRefused: the start is not at the first pose, or cannot be.
    """
    if isinstance(inverse, UrInverse):
        return follow_while(inverse, poses, start)
    targets = np.asarray(poses, dtype=np.float64)
    try:
        return inverse.follow(targets, start)
    except PathRefused as refused:
        if refused.sample == 0:
            raise
        ended = Ended(refused.joint if isinstance(refused, LimitReached) else None, isinstance(refused, Singular))
        return Followed(inverse.follow(targets[: refused.sample], start).angles, None, ended)
