"""A plan that is whole, but not one to be played, is refused at the last border."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.plan_slots import Plan
from axisync_service.motion_controller.plan_check import fault_of
from support.cells import eod_text
from support.plans import joint_plan

CELL = parse_cell(eod_text())
AXES = list(CELL.axes[:6])
START = [axis.drive.start for axis in AXES]
PLAN = joint_plan(CELL, "kingkong", START, [q + math.radians(20) for q in START])


def changed(change: Callable[[np.ndarray], None]) -> Plan:
    coefficients = PLAN.coefficients.copy()
    change(coefficients)
    return replace(PLAN, coefficients=coefficients)


def jump(c: np.ndarray) -> None:
    c[2, 0, 3] += 1e-5


def test_a_good_plan() -> None:
    assert fault_of(PLAN, AXES) is None


@pytest.mark.parametrize(
    ("plan", "text"),
    [
        (changed(jump), "apart"),
        (replace(PLAN, start=PLAN.start + 1e-5), "from its start"),
        (replace(PLAN, end=PLAN.end + 1e-5), "to its end"),
        (replace(PLAN, rate_limits=1.1 * PLAN.rate_limits), "stop limits"),
        (replace(PLAN, rate_limits=0.0 * PLAN.rate_limits), "stop limits"),
    ],
)
def test_what_is_wrong_is_said(plan: Plan, text: str) -> None:
    assert text in (fault_of(plan, AXES) or "")


def test_a_plan_that_does_not_begin_at_rest_or_is_too_fast() -> None:
    begins = PLAN.coefficients[:1].copy()
    begins[0, 1, 0] += 1e-3
    assert fault_of(replace(PLAN, coefficients=np.concatenate([begins, PLAN.coefficients[1:]])), AXES) is not None
    squeezed = replace(PLAN, knots=PLAN.knots * 0.5, coefficients=PLAN.coefficients * (2.0 ** np.arange(4))[:, None])
    assert "of the limit" in (fault_of(squeezed, AXES) or "")
