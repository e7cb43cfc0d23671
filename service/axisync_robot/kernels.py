"""What of a collision search is compiled, where numba plans (axisync_motion.backends)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from axisync_motion import backend

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Kernels(NamedTuple):
    """The compiled functions, by the names that they have in collision_loops.py."""

    segment_ends: Callable[[Array, Array, Indices, Array, Array, Array], None]
    segment_to_segment: Callable[[Array, Array, Array], None]
    segment_to_box: Callable[[Array, Array, Array], None]


def kernels() -> Kernels | None:
    """The compiled functions, or None where Python plans."""
    if backend() == "python":
        return None
    from axisync_robot.compiled import KERNELS

    return KERNELS
