"""Ways of jogs: as far as they may go, at rest at their end, within every limit; and away from whatever stops them."""

import re
from typing import Any

import numpy as np
import pytest

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import Jog, PlanJob
from axisync_schemas.plan_slots import Plan
from axisync_service.planner.jog_plan import plan_jog
from axisync_service.planner.models import Models
from axisync_service.planner.move_plan import Planned
from support.planner_jobs import (
    CELL,
    FREE,
    MODELS,
    P1,
    PAPER,
    REST,
    WUKONG,
    Array,
    at,
    degrees,
    dense,
    jumps,
    linear,
    plan_of,
    planned,
    tool_of,
    trajectory_of,
    usage,
)

SOFT = np.array([axis.soft_limits for axis in CELL.axes[:6]])
SINGULAR = degrees(0, 0, 0, 0, 0, 0)
ACROSS, OVER = degrees(75, -10, 20, -55, 145, -35), degrees(-115, 40, -35, 65, 45, -20)
"""KingKong reaching over the body to the other side, and WuKong doing the same."""
POINT = (-0.3484, 0.23)
IN_THE_BOX: dict[str, Any] = {
    "kind": "sequence",
    "steps": [
        {"kind": "joint", "target": degrees(-133, -116, -89, -123, 52, -21)},
        {"kind": "joint", "target": at((*POINT, 0.3), quaternion=(0.0, 1.0, 0.0, 0.0)), "frame": "body"},
        linear((*POINT, 0.06), frame="body", contacts=[["kingkong.6", "equipment"]]),
    ],
}
"""Lowered as by the tool change, only deeper."""


def jog(
    space: str, velocity: Any, models: Models = FREE, start: tuple[float, ...] = P1, others: tuple[Plan, ...] = (),
    **fields: Any,
) -> Planned:  # fmt: skip
    move = Jog.model_validate({"space": space, "velocity": tuple(float(v) for v in velocity)})
    given = {"group": "kingkong", "rest": (*start, *WUKONG)} | fields
    job = PlanJob(ref=1, plan_id=7, slot=0, start=start, speed_scale=1.0, move=move, **given)
    return plan_jog(models, job, others)


def refused(*arguments: Any, **fields: Any) -> Refusal:
    with pytest.raises(Refusal) as caught:
        jog(*arguments, **fields)
    return caught.value


def held(space: str, velocity: Any, models: Models, start: tuple[float, ...]) -> tuple[list[Planned], Refusal]:
    """A jog that is held until there is no way on: its parts, each from the end of the one before it."""
    parts: list[Planned] = []
    for _ in range(20):
        try:
            parts.append(jog(space, velocity, models, start))
        except Refusal as refusal:
            return parts, refusal
        start = tuple(end_of(parts[-1]).tolist())
    raise AssertionError("it never ended")


def end_of(planned: Planned) -> Array:
    return plan_of(planned).end


def speeds(planned: Planned) -> Array:
    """m/s of the tool's centre along a jog."""
    trajectory = trajectory_of(planned)
    times = np.linspace(0.0, trajectory.duration, 3000)
    arm = FREE.members("kingkong")[0].kinematics()
    points = arm.placements(trajectory.sample(times)[0])[:, :3, 3]
    return np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_goes_to_its_soft_limit_exactly(axis: int, sign: float) -> None:
    velocity = np.zeros(6)
    velocity[axis] = 0.4 * sign
    planned = jog("joint", velocity)
    expected = np.array(P1)
    expected[axis] = SOFT[axis, int(sign > 0.0)]
    assert (end_of(planned) == expected).all()
    assert planned.jog is not None
    assert f"kingkong.{axis + 1} is at its soft limit" in str(planned.jog.ends_at)
    assert usage(trajectory_of(planned)).max() <= 1.0 + 1e-9


def test_several_joints_keep_the_ratio_of_their_velocities() -> None:
    trajectory = trajectory_of(jog("joint", [0.1, 0.2, 0.0, -0.3, 0.0, 0.05]))
    _, v, _, _ = trajectory.sample(np.linspace(0.2, trajectory.duration - 0.2, 50))
    np.testing.assert_allclose(v / v[:, 1:2], [[0.5, 1.0, 0.0, -1.5, 0.0, 0.25]] * 50, atol=1e-6)


def test_a_joint_at_its_limit_goes_back_but_not_on() -> None:
    at_limit = (SOFT[0, 1], *P1[1:])
    refusal = refused("joint", [0.2, 0, 0, 0, 0, 0], start=at_limit)
    assert refusal.code is ErrorCode.SOFT_LIMIT
    assert (refusal.details["axis"], refusal.details["fix"]) == ("kingkong.1", "jog the other way")
    assert end_of(jog("joint", [-0.2, 0, 0, 0, 0, 0], start=at_limit))[0] < at_limit[0]
    assert end_of(jog("joint", [0, 0.2, 0, 0, 0, 0], start=at_limit))[1] > at_limit[1]


def test_from_outside_of_a_soft_limit_only_inwards() -> None:
    outside = (SOFT[0, 1] + 0.05, *P1[1:])
    assert refused("joint", [0.1, 0, 0, 0, 0, 0], start=outside).code is ErrorCode.SOFT_LIMIT
    assert end_of(jog("joint", [-0.1, 0, 0, 0, 0, 0], start=outside))[0] < SOFT[0, 1]


def test_the_tool_is_never_faster_than_the_cell_file_has_it() -> None:
    stretched = degrees(0, -90, 5, 0, -45, 0)
    planned = jog("joint", [2.0, -2.0, 0.3, 0, 0, 0], start=stretched)
    assert speeds(planned).max() <= 0.25 * (1 + 1e-6)
    assert speeds(planned).max() > 0.2
    assert planned.jog is not None
    assert planned.jog.limited_by == "tool_speed_max of kingkong"
    assert planned.jog.velocity[0] == -planned.jog.velocity[1] < 2.0


@pytest.mark.parametrize("space", ["tool", "base", "body"])
@pytest.mark.parametrize("direction", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_tool_goes_straight_on(space: str, direction: int, sign: float) -> None:
    velocity = np.zeros(3)
    velocity[direction] = 0.05 * sign
    planned = jog(space, velocity)
    _, poses = tool_of(planned)
    arm = FREE.members("kingkong")[0].kinematics()
    frame = {"tool": poses[0, :3, :3], "base": arm.base[:3, :3], "body": np.eye(3)}[space]
    along = frame @ (velocity / 0.05)
    moved = poses[:, :3, 3] - poses[0, :3, 3]
    assert (moved @ along)[-1] > 0.005
    assert np.abs(moved - np.outer(moved @ along, along)).max() < 1e-6
    assert np.abs(poses[:, :3, :3] - poses[0, :3, :3]).max() < 1e-6
    assert speeds(planned).max() <= 0.05 * (1 + 1e-6)
    assert usage(trajectory_of(planned)).max() <= 1.0 + 1e-9
    assert jumps(trajectory_of(planned))[:3].max() < 1e-6


def test_the_tool_turns_about_its_own_axis() -> None:
    planned = jog("tool", [0, 0, 0, 0, 0, 0.3])
    _, poses = tool_of(planned)
    assert np.abs(poses[:, :3, 3] - poses[0, :3, 3]).max() < 1e-6
    assert np.abs(poses[:, :3, 2] - poses[0, :3, 2]).max() < 1e-6
    _, v, _, _ = trajectory_of(planned).sample(dense(trajectory_of(planned)))
    assert np.abs(v[:, 5]).max() == pytest.approx(0.3, rel=1e-3)


def test_a_way_into_a_singularity_gets_slower_and_ends_before_it() -> None:
    parts, refusal = held("base", [0.05, 0.0, 0.0], FREE, P1)
    assert refusal.code in (ErrorCode.SINGULAR_PATH, ErrorCode.UNREACHABLE)
    assert max(usage(trajectory_of(part)).max() for part in parts) <= 1.0 + 1e-9
    velocities = [part.jog.velocity[0] for part in parts if part.jog is not None]
    assert velocities[0] == pytest.approx(0.05)
    assert velocities[-1] < 0.5 * velocities[0]
    start = tuple(end_of(parts[-1]).tolist())
    back = jog("base", [-0.05, 0.0, 0.0], start=start)
    assert np.abs(end_of(back) - np.array(start)).max() > 0.02


def test_out_of_a_singularity_by_the_joints() -> None:
    refusal = refused("base", [0.0, 0.0, -0.05], start=SINGULAR)
    assert (refusal.code, refusal.details["fix"]) == (ErrorCode.SINGULAR_PATH, "jog its joints")
    assert end_of(jog("joint", [0, -0.2, 0.3, 0, 0, 0], start=SINGULAR))[2] > 0.1


def test_a_way_ends_before_anything_is_near_and_leads_away_again() -> None:
    parts, refusal = held("joint", [0, 0, 0.2, 0, 0, 0], MODELS, P1)
    assert refusal.code is ErrorCode.COLLISION
    assert parts[0].jog is not None
    assert parts[0].jog.ends_at == "kingkong link 1 and kingkong link 3 would come too near"
    margin = CELL.geometry.margin
    least = [part.reply.min_distance_m or 0.0 for part in parts]
    assert margin <= min(least) <= least[0] < margin + 0.006
    start = tuple(end_of(parts[-1]).tolist())
    near = MODELS.collision.clearance((*start, *WUKONG))
    assert near is not None
    assert near.distance >= margin
    assert end_of(jog("joint", [0, 0, -0.2, 0, 0, 0], MODELS, start))[2] < start[2] - 0.5


def test_nearer_than_the_margin_only_away() -> None:
    """As a cell file with a larger margin would find an arm."""
    q = np.array(P1)
    while True:  # link 3 towards link 1, to about 2 mm
        near = MODELS.collision.clearance((*q, *WUKONG))
        assert near is not None
        if near.distance < 0.003:
            break
        q[2] += 0.002
    start = tuple(q.tolist())
    refusal = refused("joint", [0, 0, 0.2, 0, 0, 0], MODELS, start)
    assert refusal.code is ErrorCode.COLLISION
    assert end_of(jog("joint", [0, 0, -0.2, 0, 0, 0], MODELS, start))[2] < start[2] - 0.1


def test_a_tool_in_a_declared_contact_is_jogged_out_of_it() -> None:
    start = tuple(end_of(planned(IN_THE_BOX, MODELS, start=PAPER)).tolist())
    touching = MODELS.collision.clearance((*start, *WUKONG))
    assert touching is not None
    assert touching.distance < 0.0
    up = jog("body", [0.0, 0.0, 0.05], MODELS, start)
    tool = FREE.members("kingkong")[0].kinematics()
    assert tool.placement(end_of(up))[2, 3] > tool.placement(np.array(start))[2, 3] + 0.1


def test_the_other_arm_ends_a_jog_where_it_stands_and_where_it_moves() -> None:
    """WuKong towards OVER, which KingKong's ACROSS is in the way of."""
    velocity = (np.array(OVER) - np.array(WUKONG)) / 10.0
    free = jog("joint", velocity, MODELS, WUKONG, group="wukong", rest=REST)
    stands = jog("joint", velocity, MODELS, WUKONG, group="wukong", rest=(*ACROSS, *WUKONG))
    leaves = plan_of(jog("joint", (np.array(P1) - np.array(ACROSS)) / 10.0, MODELS, ACROSS))
    moves = jog("joint", velocity, MODELS, WUKONG, (leaves,), group="wukong", rest=REST)
    for beside in (stands, moves):
        assert beside.jog is not None
        assert re.search(r"(kingkong.*wukong|wukong.*kingkong).* would come too near", str(beside.jog.ends_at))
        assert beside.reply.min_distance_m is not None
        assert beside.reply.min_distance_m >= CELL.geometry.margin
        assert np.abs(end_of(beside) - WUKONG).max() < np.abs(end_of(free) - WUKONG).max() - 0.02
        there = tuple(end_of(beside).tolist())
        back = jog("joint", -velocity, MODELS, there, group="wukong", rest=(*ACROSS, *there))
        assert np.abs(end_of(back) - there).max() > 0.1


@pytest.mark.parametrize("seed", range(2))
def test_chains_of_random_jogs_keep_every_limit(seed: int) -> None:
    """Each from somewhere on the way of the one before it."""
    rng = np.random.default_rng(seed)
    q = np.array(P1)
    planned_count, codes = 0, set()
    for _ in range(9):
        space = str(rng.choice(["joint", "tool", "base", "body"]))
        velocity = rng.normal(0.0, 0.4, 6) if space == "joint" else rng.normal(0.0, 1.0, 6) * ([0.1] * 3 + [0.3] * 3)
        try:
            planned = jog(space, velocity, MODELS, tuple(q.tolist()))
        except Refusal as refusal:
            codes.add(refusal.code)
            continue
        trajectory = trajectory_of(planned)
        planned_count += 1
        assert usage(trajectory).max() <= 1.0 + 1e-9
        assert speeds(planned).max() <= 0.25 * (1 + 1e-6)
        positions = trajectory.sample(dense(trajectory))[0]
        assert (positions >= SOFT[:, 0] - 1e-9).all()
        assert (positions <= SOFT[:, 1] + 1e-9).all()
        assert (trajectory.start == q).all()
        q = trajectory.sample(np.array([rng.uniform(0.2, 1.0) * trajectory.duration]))[0][0]
    assert planned_count > 3
    assert not codes & {ErrorCode.INTERNAL, ErrorCode.INVALID_REQUEST}


def test_a_jog_of_both_arms_by_their_joints() -> None:
    planned = jog("joint", [0.1] + [0.0] * 5 + [0.0, 0.1] + [0.0] * 4, FREE, REST, group="both", rest=REST)
    assert (end_of(planned) > np.array(REST)).nonzero()[0].tolist() == [0, 7]
    refusal = refused("base", [0.0, 0.0, 0.1], start=REST, group="both", rest=REST)
    assert refusal.code is ErrorCode.INVALID_REQUEST
