"""Plans for tests, made with the planner library alone."""

from collections.abc import Sequence

import numpy as np

from axisync_motion import synchronise
from axisync_motion.from_profiles import from_profiles
from axisync_motion.rate_tables import RateTables, rate_tables
from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Cell
from axisync_schemas.plan_slots import Plan


def joint_plan(cell: Cell, group: str, start: Sequence[float], target: Sequence[float], plan_id: int = 1) -> Plan:
    """MASA with f_A from `start` to `target`, rad, within the cell's limits."""
    indices = cell.axis_indices(group)
    axes = [cell.axes[i] for i in indices]
    origin, end = np.array(start, dtype=float), np.array(target, dtype=float)
    v = [axis.limits.velocity for axis in axes]
    profile = synchronise(
        end - origin, v, [axis.limits.acceleration for axis in axes], [axis.limits.jerk for axis in axes]
    )
    trajectory = from_profiles(origin, profile, end)
    tables = tables_of(cell, indices, trajectory)
    return Plan(
        plan_id=plan_id,
        axes=np.array(indices, dtype=np.uint32),
        knots=trajectory.knots,
        coefficients=trajectory.coefficients,
        start=trajectory.start,
        end=trajectory.end,
        rate_codes=tables.codes,
        rate_limits=tables.limits,
    )


def tables_of(cell: Cell, indices: Sequence[int], trajectory: Trajectory) -> RateTables:
    """What the path clock needs, for the limits of these axes."""
    axes = [cell.axes[i] for i in indices]
    return rate_tables(
        trajectory,
        [axis.limits.velocity for axis in axes],
        [axis.limits.acceleration for axis in axes],
        [axis.limits.jerk for axis in axes],
        [axis.stop_limits.acceleration for axis in axes],
        [axis.stop_limits.jerk for axis in axes],
    )
