"""closed_forms.py, bound_loops.py and rate_loops.py, compiled by numba. Imported when backends.py chooses it.

With explicit signatures all is compiled, or read from numba's cache, on import and nothing later. Without fastmath no
operation is reordered or contracted: results are those of the same functions run by Python. Raises what numba raises.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit, void
from numba.core import config
from numba.extending import overload, register_jitable

from . import bound_loops, closed_forms, rate_loops
from .backends import Kernels

VECTOR, MATRIX, BLOCK = float64[::1], float64[:, ::1], float64[:, :, ::1]

CALLED = (
    closed_forms.capped_acceleration,
    closed_forms.shortest,
    closed_forms.optimal_shape,
    closed_forms.peak_velocity,
    closed_forms.velocity_shape,
    closed_forms.acceleration_shape,
    closed_forms.jerk_shape,
    closed_forms.shape,
    closed_forms.signed_peak,
    closed_forms.prepare,
    closed_forms.plan_batch,
    bound_loops.shift,
    bound_loops.differentiate,
    bound_loops.hull,
    rate_loops.moves,
    rate_loops.fill_rows,
    rate_loops.sweep,
    rate_loops.curvature,
    rate_loops.fastest,
    rate_loops.sum_up,
    rate_loops.go_on,
    rate_loops.keep_passable,
)
"""What the compiled functions call."""


def compile_now(function: Callable[..., Any], signature: object) -> Callable[..., Any]:
    """For these types; or read from numba's cache."""
    compiled: Callable[..., Any] = njit([signature], cache=True, error_model="numpy")(function)
    return compiled


if config.DISABLE_JIT:
    raise RuntimeError("NUMBA_DISABLE_JIT is set")
overload(math.cbrt)(lambda x: lambda x: np.cbrt(x))  # either is the C library's, and numba knows but one
for _function in CALLED:
    register_jitable(_function)

KERNELS = Kernels(
    compile_now(closed_forms.plan_move, float64(MATRIX, int64, float64, boolean, MATRIX, MATRIX)),
    compile_now(closed_forms.plan_batch, boolean(MATRIX, MATRIX, int64, VECTOR, boolean, BLOCK, BLOCK, VECTOR, VECTOR)),
    compile_now(bound_loops.cell_bounds, void(VECTOR, BLOCK, VECTOR, MATRIX, MATRIX)),
    compile_now(
        rate_loops.rate_slopes,
        void(BLOCK, MATRIX, MATRIX, float64, VECTOR, MATRIX, MATRIX, VECTOR, BLOCK),
    ),
)
