"""The last look at a plan before it moves anything: whatever can be seen at its knots at little cost. Pure."""

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import Axis
from axisync_schemas.plan_slots import Plan

Array = NDArray[np.float64]

JOIN = 1e-7
"""rad: a sixtieth of a count of 2^20 a turn."""
REST = 1e-6
"""rad/s"""
LIMIT = 1.0 + 1e-6


def fault_of(plan: Plan, axes: list[Axis]) -> str | None:
    """Why a plan for these axes must not be played; None: nothing is to be seen."""
    v, a, a_stop, j_stop = (
        np.array(limits)
        for limits in zip(
            *((x.limits.velocity, x.stop_limits.acceleration, x.stop_limits.acceleration, x.stop_limits.jerk)
              for x in axes), strict=True)
    )  # fmt: skip
    first, last = plan.coefficients, _at_ends(plan)
    gaps = np.abs(first[1:, 0] - last[0][:-1])
    if gaps.size and gaps.max() > JOIN:
        return f"its pieces are up to {gaps.max():.3g} rad apart"
    if np.abs(first[0, 0] - plan.start).max() > JOIN or np.abs(last[0][-1] - plan.end).max() > JOIN:
        return "it does not lead from its start to its end"
    if max(np.abs(first[0, 1]).max(), np.abs(last[1][-1]).max()) > REST:
        return "it does not begin and end at rest"
    for name, at_begins, at_ends, limit in (
        ("velocity", first[:, 1], last[1], v), ("acceleration", 2.0 * first[:, 2], last[2], a),
    ):  # fmt: skip
        share = np.maximum(np.abs(at_begins), np.abs(at_ends)) / limit
        if share.max() > LIMIT:
            return f"{axes[int(share.max(axis=0).argmax())].name}: its {name} is {share.max():.3g} of the limit"
    if (plan.rate_limits <= 0.0).any() or (plan.rate_limits[2:] > LIMIT * np.array([a_stop, j_stop])).any():
        return "its stops would not keep the axes' stop limits"
    return None


def _at_ends(plan: Plan) -> tuple[Array, Array, Array]:
    """[m, n] position, velocity and acceleration at the end of each piece, by Horner's rule."""
    x = np.diff(plan.knots)[:, np.newaxis]
    q, v, a = (np.zeros_like(plan.coefficients[:, 0]) for _ in range(3))
    for k in range(plan.coefficients.shape[1] - 1, -1, -1):
        a = a * x + 2.0 * v
        v = v * x + q
        q = q * x + plan.coefficients[:, k]
    return q, v, a
