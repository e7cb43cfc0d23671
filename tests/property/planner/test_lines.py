"""Any line of either arm: planned within every limit and on its line, or refused with a code and its numbers."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.planner.move_plan import Planned
from support.planner_jobs import FREE, LIMITS, at, dense, jumps, linear, planned, trajectory_of, usage

LISTED = {ErrorCode.UNREACHABLE, ErrorCode.SINGULAR_PATH, ErrorCode.SOFT_LIMIT, ErrorCode.JOINT_LIMIT}
STARTS = st.lists(st.floats(-2.6, 2.6), min_size=6, max_size=6).map(tuple)
SIZES = st.sampled_from([1e-5, 1e-4, 1e-3, 0.02, 0.1, 0.4])
DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
OPTIONS = st.fixed_dictionaries(
    {
        "pulse": st.sampled_from(["constant", "parabolic"]),
        "orientation": st.sampled_from(["rotation_vector", "euler_zyz"]),
        "minimise": st.sampled_from(["acceleration", "velocity", "jerk"]),
        "frame": st.sampled_from(["base", "body", "tool"]),
    }
)


def planned_or_refused(move: Any, **fields: Any) -> Planned | Refusal:
    try:
        return planned(move, **fields)
    except Refusal as refusal:
        return refusal


@pytest.mark.parametrize("group", ["kingkong", "wukong"])
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    start=STARTS, way=DIRECTIONS, size=SIZES, turn=DIRECTIONS, angle=SIZES, options=OPTIONS, speed=st.floats(0.2, 1.0)
)
def test_any_line_is_planned_within_limits_or_refused(
    group: str,
    start: tuple[float, ...],
    way: tuple[float, ...],
    size: float,
    turn: tuple[float, ...],
    angle: float,
    options: dict[str, Any],
    speed: float,
) -> None:
    half = 0.5 * angle * np.array(turn)
    pose = at(size * np.array(way), quaternion=(*half.tolist(), math.sqrt(1.0 - half @ half)))
    move = linear(pose, relative=True, **options)
    result = planned_or_refused(move, start=start, group=group, speed_scale=speed)
    if isinstance(result, Refusal):
        assert result.code in LISTED, result.message
        assert result.details
        return
    if result.plan is None:
        return
    trajectory = trajectory_of(result)
    arm = FREE.members(group)[0].kinematics()
    assert usage(trajectory).max() <= 1.0 + 1e-9
    assert (jumps(trajectory)[:3] < [1e-7, 1e-6, 1e-2 * LIMITS[1]]).all()
    tool = arm.placements(trajectory.sample(dense(trajectory, 300))[0])[:, :3, 3]
    begin, end = tool[0], arm.placement(result.reply.end)[:3, 3]
    away = end - begin
    length = float(np.linalg.norm(away))
    along = np.clip((tool - begin) @ (away / length), 0.0, length) if length > 1e-9 else np.zeros(len(tool))
    nearest = begin + along[:, None] * (away / length if length > 1e-9 else away)
    assert np.linalg.norm(tool - nearest, axis=1).max() < 1e-6
