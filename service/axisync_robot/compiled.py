"""collision_loops.py, compiled by numba as axisync_motion.compiled does it. Imported by kernels.py only."""

from numba import float64, intp, void
from numba.extending import register_jitable

from axisync_motion.compiled import BLOCK, MATRIX, compile_now
from axisync_robot import collision_loops
from axisync_robot.kernels import Kernels

SEGMENTS, VECTOR = float64[:, :, :, ::1], float64[::1]

for _function in (
    collision_loops.step,
    collision_loops.place,
    collision_loops.corners,
    collision_loops.clamped,
    collision_loops.outside,
):
    register_jitable(_function)

KERNELS = Kernels(
    compile_now(collision_loops.segment_ends, void(BLOCK, MATRIX, intp[::1], BLOCK, MATRIX, SEGMENTS)),
    compile_now(collision_loops.segment_to_segment, void(BLOCK, BLOCK, VECTOR)),
    compile_now(collision_loops.segment_to_box, void(BLOCK, MATRIX, VECTOR)),
)
