"""One pose: the configuration that is soonest reached."""

import numpy as np
from numpy.typing import NDArray

from axisync_robot.inverse import Inverse
from axisync_robot.inverse_path import limit_reached, unreachable
from axisync_robot.ur_inverse import UrInverse

Array = NDArray[np.float64]


def solve_pose(inverse: Inverse, pose: Array, start: Array, speeds: Array) -> Array:
    """Joint angles [n] at pose [4, 4] in O within the solver's limits, soonest reached from start[n] at speeds[n].

    Raises:
        Unreachable: by no configuration.
        LimitReached: by none within the limits.
    """
    if not isinstance(inverse, UrInverse):
        near = inverse.solve(pose, start)
        if not near.reached:
            raise inverse.refusal(0, pose, near)
        return near.angles
    found = inverse.solve(pose[np.newaxis], start)
    times = (np.abs(found.angles[0] - start) / speeds).max(axis=1)
    within = np.where(found.within[0], times, np.inf)
    if np.isfinite(within).any():
        best: Array = found.angles[0, int(within.argmin())]
        return best
    if not found.reachable[0].any():
        raise unreachable(inverse, pose, start, 0)
    nearest = int(np.where(found.reachable[0], times, np.inf).argmin())
    raise limit_reached(inverse, found.angles[0, nearest], 0)
