"""Plans of joint moves: the paper's, refusals with their numbers, and what the slot then holds."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_schemas.cell import parse_cell
from axisync_schemas.errors import ErrorCode
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.moves import JointMove
from axisync_schemas.plan_slots import read_plan, write_plan
from axisync_service.planner.box import room
from axisync_service.planner.models import Models
from axisync_service.planner.targets import joint_target
from support.planner_jobs import CELL, FREE, FREE_TEXT, P1, P2, WUKONG, plan_of, planned, refused, trajectory_of


def test_the_slowest_axis_sets_the_time() -> None:
    result = planned(JointMove(target=P2))
    reply = result.reply
    slowest = max(range(6), key=lambda i: reply.minimum_s[i])
    assert reply.duration_s == reply.minimum_s[slowest]
    assert reply.limiting == reply.scalars[slowest] == f"kingkong.{slowest + 1}"
    assert np.array(reply.T).shape == np.array(reply.U).shape == (6, 7)
    assert np.array(reply.T).sum(axis=1)[slowest] == pytest.approx(reply.duration_s, rel=1e-12)


def test_a_plan_begins_and_ends_exactly_and_keeps_the_limits() -> None:
    result = planned(JointMove(target=P2))
    plan, trajectory = result.plan, trajectory_of(result)
    assert plan is not None
    assert tuple(plan.start.tolist()) == P1
    assert tuple(plan.end.tolist()) == P2
    assert plan.axes.tolist() == [0, 1, 2, 3, 4, 5]
    assert plan.duration == result.reply.duration_s
    _, v, a, j = trajectory.sample(np.linspace(0.0, plan.duration, 2000))
    for values, bound in ((v, 30.0), (a, 40.0), (j, 80.0)):
        assert np.degrees(np.abs(values).max()) <= bound * (1 + 1e-9)
    assert np.degrees(plan.rate_limits[:, 0]) == pytest.approx([40.0, 80.0, 60.0, 240.0])
    assert plan.rate_codes[0].any()


def test_members_of_a_compound_move_as_one() -> None:
    start = P1 + WUKONG
    result = planned(JointMove(target=(0.1,) * 12, relative=True), group="both", start=start)
    plan = result.plan
    assert plan is not None
    assert plan.axes.tolist() == list(range(12))
    assert result.reply.scalars[6] == "wukong.1"
    assert tuple(plan.end.tolist()) == tuple(q + 0.1 for q in start)


@pytest.mark.parametrize("minimise", ["acceleration", "velocity", "jerk"])
@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
def test_every_kind_of_pulse_and_map(minimise: Any, pulse: Any) -> None:
    result = planned(JointMove(target=P2, minimise=minimise, pulse=pulse))
    _, v, a, j = trajectory_of(result).sample(np.linspace(0.0, result.reply.duration_s, 500))
    for values, bound in ((v, 30.0), (a, 40.0), (j, 80.0)):
        assert np.degrees(np.abs(values).max()) <= bound * (1 + 1e-9)


@pytest.mark.parametrize("scale", [0.5, 0.1])
def test_speed_scale_stretches_the_same_curve(scale: float) -> None:
    fast, slow = planned(JointMove(target=P2)), planned(JointMove(target=P2), speed_scale=scale)
    assert slow.reply.duration_s == pytest.approx(fast.reply.duration_s / scale, rel=1e-12)
    there, here = trajectory_of(fast), trajectory_of(slow)
    s = np.linspace(0.0, fast.reply.duration_s, 50)
    assert np.abs(there.sample(s)[0] - here.sample(s / scale)[0]).max() < 1e-12


def test_a_longer_duration_is_kept() -> None:
    assert planned(JointMove(target=P2, duration_s=10.0)).reply.duration_s == 10.0


def test_too_short_a_duration_names_the_shortest() -> None:
    shortest = planned(JointMove(target=P2)).reply.duration_s
    error = refused(JointMove(target=P2, duration_s=1.0))
    assert error.code is ErrorCode.INFEASIBLE_DURATION
    assert error.details["shortest_duration_s"] == shortest
    assert error.details["axis"].startswith("kingkong.")
    again = planned(JointMove(target=P2, duration_s=shortest))
    assert again.reply.duration_s == shortest


@pytest.mark.parametrize("move", [JointMove(target=P1), JointMove(target=(0.0,) * 6, relative=True)])
def test_a_move_of_no_length(move: JointMove) -> None:
    result = planned(move)
    assert result.plan is None
    assert result.reply.duration_s == 0.0
    assert result.reply.limiting is None
    assert np.isfinite(np.array(result.reply.T)).all()


def test_a_move_of_one_ulp() -> None:
    target = (math.nextafter(P1[1], 1.0),)
    result = planned(JointMove(target=(P1[0], *target, *P1[2:])))
    plan = result.plan
    assert plan is not None
    assert plan.end[1] == target[0]
    assert 0.0 < plan.duration < 1e-3
    buffer = bytearray(PLAN_SLOT_BYTES)
    write_plan(buffer, 0, plan)
    assert np.array_equal(read_plan(buffer, 0, 7).coefficients, plan.coefficients)


def test_only_looking_makes_no_plan() -> None:
    looked = planned(JointMove(target=P2), slot=None)
    assert looked.plan is None
    assert looked.reply == planned(JointMove(target=P2)).reply


def test_a_drive_left_alone_near_its_hard_limit() -> None:
    """A weak quick-stop ramp would carry it past a target that the path itself reaches well braked."""
    weak = FREE_TEXT.replace("hard_limits_deg = [-180, 180]", "hard_limits_deg = [-180, 171]")
    cell = parse_cell(weak.replace("quick_stop_deceleration_deg_s2 = 90", "quick_stop_deceleration_deg_s2 = 20"))
    models = Models(cell)
    target, start = (math.radians(169.0), *(0.0,) * 5), (0.0,) * 6
    error = refused(JointMove(target=target), models, start=start)
    assert error.code is ErrorCode.JOINT_LIMIT
    assert error.details["axis"] == "kingkong.1"
    assert error.details["required"] > error.details["allowed"] == math.radians(171.0)
    slow = planned(JointMove(target=target, duration_s=60.0), models, start=start)
    assert slow.reply.alone is not None
    assert (slow.reply.alone.axis, slow.reply.alone.limit_margin > 0.0) == ("kingkong.1", True)


def test_the_box_bounds_the_exact_reach() -> None:
    """The sampled reach with its allowance is never below a dense sampling of the exact one, and hardly above."""
    result = planned(JointMove(target=P2))
    trajectory = trajectory_of(result)
    q, v, _, _ = trajectory.sample(np.linspace(0.0, result.reply.duration_s, 50_001))
    ramp = np.array([axis.drive.quick_stop_deceleration for axis in CELL.axes[:6]])
    exact = (q + np.abs(v) * 7 * CELL.period + v * v / (2 * ramp)).max(axis=0)
    for axis, (margin, expected) in itertools.product(range(6), ((-1e-9, True), (math.radians(0.2), False))):
        bound = exact[axis] + margin
        axes = tuple(
            one.model_copy(update={"hard_limits": (-10.0, bound if i == axis else 10.0)})
            for i, one in enumerate(CELL.axes)
        )
        found = room(trajectory, CELL.model_copy(update={"axes": axes}), tuple(range(6)))
        assert (found.margin < 0.0) is expected
        assert found.axis == f"kingkong.{axis + 1}"


# Distances below 1e-60 rad are refused as INVALID_REQUEST by the planner's own checks.
ANGLES = st.lists(st.floats(-2.9, 2.9).map(lambda q: 0.0 if abs(q) < 1e-50 else q), min_size=6, max_size=6)


@settings(max_examples=25, deadline=None)
@given(
    ANGLES,
    ANGLES,
    st.floats(0.01, 1.0),
)
def test_any_move_within_the_limits_is_planned(start: list[float], target: list[float], scale: float) -> None:
    result = planned(JointMove(target=tuple(target)), start=tuple(start), speed_scale=scale)
    if result.plan is not None:
        assert tuple(result.plan.end.tolist()) == tuple(target)
        assert np.isfinite(result.plan.coefficients).all()
        assert (np.diff(result.plan.knots) > 0.0).all()


def test_targets() -> None:
    axes = FREE.axes("kingkong")
    assert joint_target(axes, P2, False, np.array(P1)).tolist() == list(P2)
    start = np.array([0.1, -1.0, 0.2, 0.3, 0.4, 0.5])
    moved = joint_target(axes, (1.0, -0.5, 0.0, 0.0, 0.0, 0.25), True, start)
    assert moved.tolist() == [1.1, -1.5, 0.2, 0.3, 0.4, 0.75]


def test_the_number_of_axes() -> None:
    error = refused(JointMove(target=(0.0,) * 5))
    assert error.code is ErrorCode.INVALID_REQUEST
    assert error.details["errors"][0]["path"] == "move.target"
    assert error.details["axes"][0] == "kingkong.1"


@pytest.mark.parametrize(
    ("start", "target", "relative", "bound"),
    [(0.0, 171.0, False, 170.0), (0.0, -171.0, False, -170.0), (160.0, 20.0, True, 170.0), (0.0, 1e300, False, 170.0)],
)
def test_soft_limits_name_axis_value_and_bound(start: float, target: float, relative: bool, bound: float) -> None:
    move = JointMove(target=(0.0, 0.0, math.radians(target), 0.0, 0.0, 0.0), relative=relative)
    error = refused(move, start=(0.0, 0.0, math.radians(start), 0.0, 0.0, 0.0))
    assert error.code is ErrorCode.SOFT_LIMIT
    assert error.details["axis"] == "kingkong.3"
    assert error.details["bound"] == error.details["nearest_allowed"] == pytest.approx(math.radians(bound))
    assert error.details["value"] == pytest.approx(math.radians(start * relative + target))


def test_the_limit_itself_is_allowed() -> None:
    high = FREE.axes("kingkong")[0].soft_limits[1]
    end = plan_of(planned(JointMove(target=(high,) * 6), start=(0.0,) * 6)).end
    assert end.tolist() == [high] * 6
    assert planned(JointMove(target=(0.0,) * 6, relative=True), start=(high,) * 6).plan is None


def test_a_relative_move_far_beyond_everything_is_refused() -> None:
    error = refused(JointMove(target=(1.7e308,) * 6, relative=True))
    assert error.code is ErrorCode.SOFT_LIMIT
    assert math.isfinite(error.details["value"])
