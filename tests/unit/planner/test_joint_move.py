"""Plans of joint moves: the paper's, refusals with their numbers, and what the slot then holds."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import parse_cell, read_cell
from axisync_schemas.commands import JointMove
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import PlanJob
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import read_plan, write_plan
from axisync_service.planner.box import breach
from axisync_service.planner.joint_move import Planned, plan_joint_move
from axisync_service.planner.targets import target_of

CELL, TEXT = read_cell(Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml")
P1 = tuple(map(math.radians, (0.0, -150.0, 60.0, -45.0, -45.0, 45.0)))
P2 = tuple(map(math.radians, (-90.0, -100.0, -45.0, -110.0, 45.0, 45.0)))


def job(
    move: JointMove, start: tuple[float, ...] = P1, group: str = "kingkong", slot: int | None = 0, **rest: Any
) -> PlanJob:
    fields = {"ref": 1, "plan_id": 7, "speed_scale": 1.0} | rest
    return PlanJob(group=group, slot=slot, start=start, move=move, **fields)


def planned(move: JointMove, **rest: Any) -> Planned:
    return plan_joint_move(CELL, job(move, **rest))


def trajectory_of(result: Planned) -> Trajectory:
    plan = result.plan
    assert plan is not None
    return Trajectory(plan.knots, plan.coefficients, plan.start, plan.end)


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
    assert (plan.stop_duration[:-1] > 0.0).all()


def test_members_of_a_compound_move_as_one() -> None:
    start = P1 * 2
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
    with pytest.raises(Refusal) as caught:
        planned(JointMove(target=P2, duration_s=1.0))
    assert caught.value.code is ErrorCode.INFEASIBLE_DURATION
    assert caught.value.details["shortest_duration_s"] == shortest
    assert caught.value.details["axis"].startswith("kingkong.")
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
    weak = TEXT.replace("hard_limits_deg = [-180, 180]", "hard_limits_deg = [-180, 171]")
    cell = parse_cell(weak.replace("quick_stop_deceleration_deg_s2 = 90", "quick_stop_deceleration_deg_s2 = 20"))
    target, start = (math.radians(169.0), *(0.0,) * 5), (0.0,) * 6
    with pytest.raises(Refusal) as caught:
        plan_joint_move(cell, job(JointMove(target=target), start=start))
    assert caught.value.code is ErrorCode.JOINT_LIMIT
    details = caught.value.details
    assert details["axis"] == "kingkong.1"
    assert details["required"] > details["allowed"] == math.radians(171.0)
    assert plan_joint_move(cell, job(JointMove(target=target, duration_s=60.0), start=start)).plan is not None


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
            for i, one in enumerate(CELL.axes[:6])
        )
        found = breach(trajectory, axes, CELL.period, CELL.missed_ticks_max)
        assert (found is not None and found.axis == f"kingkong.{axis + 1}") is expected


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
    assert target_of(JointMove(target=(1.0, 2.0)), (5.0, 5.0)) == (1.0, 2.0)
    assert target_of(JointMove(target=(1.0, 2.0), relative=True), (5.0, -5.0)) == (6.0, -3.0)
