"""Steps one after the other: planned whole or refused whole, naming the step."""

import itertools
from typing import Any

import numpy as np
import pytest

from axisync_schemas.errors import ErrorCode
from axisync_schemas.moves import MAX_STEPS
from support.planner_jobs import (
    FREE,
    MODELS,
    P1,
    P2,
    PAPER,
    at,
    by,
    degrees,
    jumps,
    linear,
    plan_of,
    planned,
    refused,
    trajectory_of,
    usage,
)

DOWN = (0.0, 1.0, 0.0, 0.0)
A, B, C, D = (-0.2719, 0.157, 0.3), (-0.2719, 0.157, 0.1), (-0.3484, 0.23, 0.3), (-0.3484, 0.23, 0.1)


def sequence(*steps: dict[str, Any]) -> dict[str, Any]:
    return {"kind": "sequence", "steps": steps}


def joint(target: Any, **options: Any) -> dict[str, Any]:
    return {"kind": "joint", "target": tuple(target), **options}


def dwell(seconds: float) -> dict[str, Any]:
    return {"kind": "dwell", "duration_s": seconds}


def down(position: tuple[float, ...]) -> dict[str, Any]:
    return linear(at(position, quaternion=DOWN), frame="body")


def over(position: tuple[float, ...]) -> dict[str, Any]:
    return {"kind": "joint", "target": at(position, quaternion=DOWN), "frame": "body"}


READY = (joint(degrees(-90, -150, 45, -90, -90, -90)), joint(degrees(-133, -116, -89, -123, 52, -21)))
TOOL_CHANGE = sequence(*READY, over(A), down(B), down(A), over(C), down(D), down(C))


def test_the_papers_tool_change() -> None:
    """V.C.2: A, B, A, C, D, C from its two via points, all clear of body and equipment."""
    result = planned(TOOL_CHANGE, MODELS)
    reply, trajectory = result.reply, trajectory_of(result)
    assert [step.kind for step in reply.steps] == ["joint"] * 3 + ["linear"] * 2 + ["joint"] + ["linear"] * 2
    assert usage(trajectory).max() <= 1.0 + 1e-9
    assert (jumps(trajectory)[:3] < [1e-9, 1e-7, 1e-5]).all()
    arm = MODELS.members("kingkong")[0].kinematics()
    ends = [step.begins_s for step in reply.steps[3:]] + [reply.duration_s]
    for end, corner in zip(ends, (A, B, A, C, D, C), strict=True):
        pose = arm.placement(trajectory.sample([end])[0][0])
        assert np.abs(pose[:3, 3] - corner).max() < 1e-8
        assert np.abs(pose[:3, :3] - np.diag([-1.0, 1.0, -1.0])).max() < 1e-8
    for index, (begin, end) in {3: (A, B), 4: (B, A), 6: (C, D), 7: (D, C)}.items():
        step = reply.steps[index]
        times = np.linspace(step.begins_s, step.begins_s + step.duration_s, 300)
        tool = arm.placements(trajectory.sample(times)[0])[:, :3, 3]
        along = (np.array(end) - begin) / np.linalg.norm(np.subtract(end, begin))
        across = tool - begin - np.outer((tool - begin) @ along, along)
        assert np.linalg.norm(across, axis=1).max() < 1e-8


def test_steps_follow_each_other_at_rest() -> None:
    result = planned(sequence(joint(P2), dwell(0.5), by(0, 0, 0.01), joint((0,) * 6, relative=True), by(0, 0, -0.01)))
    reply, trajectory = result.reply, trajectory_of(result)
    assert (reply.scalars, reply.T, reply.limiting) == ((), (), None)
    assert [step.kind for step in reply.steps] == ["joint", "dwell", "linear", "joint", "linear"]
    assert reply.steps[3].duration_s == 0.0
    for one, two in itertools.pairwise(reply.steps):
        assert two.begins_s == pytest.approx(one.begins_s + one.duration_s, rel=1e-12)
        _, *still = trajectory.sample([two.begins_s])
        assert np.abs(still[:2]).max() < 1e-6
    assert reply.duration_s == pytest.approx(sum(step.duration_s for step in reply.steps), rel=1e-12)
    waits = np.linspace(reply.steps[1].begins_s + 1e-9, reply.steps[2].begins_s - 1e-9, 9)
    assert (trajectory.sample(waits)[0] == P2).all()
    assert reply.end == pytest.approx(P2, abs=1e-8)
    assert reply.scale == max(step.scale for step in reply.steps)


def test_a_sequence_of_one_step_is_that_step() -> None:
    one, alone = planned(sequence(joint(P2))), planned(joint(P2))
    assert np.array_equal(plan_of(one).coefficients, plan_of(alone).coefficients)
    assert one.reply.duration_s == alone.reply.duration_s


@pytest.mark.parametrize("seconds", [1e-9, 0.5, 3600.0])
def test_dwells_alone(seconds: float) -> None:
    result = planned(sequence(dwell(seconds), dwell(seconds)))
    assert result.reply.duration_s == 2.0 * seconds
    assert (plan_of(result).end == P1).all()


def test_steps_that_go_nowhere() -> None:
    result = planned(sequence(by(0, 0, 0), joint(P1)))
    assert result.plan is None
    assert (result.reply.duration_s, len(result.reply.steps)) == (0.0, 2)


@pytest.mark.parametrize(
    ("step", "code"),
    [
        (joint(degrees(0, 0, 171, 0, 0, 0)), ErrorCode.SOFT_LIMIT),
        (linear((2.0, 0.0, 0.0)), ErrorCode.UNREACHABLE),
        (by(0.05, 0.0, 0.05), ErrorCode.SINGULAR_PATH),
        (by(0, 0, 0.02, duration_s=0.01), ErrorCode.INFEASIBLE_DURATION),
        (by(0, 0, 0.02, retime=False, linear_limits=(1.0, 2.0, 4.0)), ErrorCode.JOINT_LIMIT),
        (joint((0.0,) * 5), ErrorCode.INVALID_REQUEST),
        (joint(degrees(0, -150, 168, -45, -45, 45)), ErrorCode.COLLISION),
    ],
)
def test_a_step_that_cannot_be_refuses_the_whole_and_is_named(step: dict[str, Any], code: ErrorCode) -> None:
    error = refused(sequence(joint(P2), joint(P1), step, joint(P2)), MODELS)
    assert error.code is code
    assert error.details["step"] == 2
    assert error.message.startswith(f"step 3 of 4 ({step['kind']}): ")
    assert refused(step, MODELS).code is code


def test_each_step_begins_where_the_one_before_it_ended() -> None:
    alone = planned(by(0.02, 0.02, -0.02), start=PAPER).reply.end
    result = planned(sequence(joint(PAPER), by(0.02, 0.02, -0.02)))
    assert result.reply.end == pytest.approx(alone, abs=1e-9)


def test_as_many_steps_as_a_request_may_have_fit_a_slot() -> None:
    turn = (joint((0.01, 0, 0, 0, 0, 0), relative=True), joint((-0.01, 0, 0, 0, 0, 0), relative=True))
    result = planned(sequence(*turn * (MAX_STEPS // 2)))
    plan = plan_of(result)
    assert len(result.reply.steps) == MAX_STEPS
    assert plan.coefficients.nbytes < 4 * 1024 * 1024
    assert plan.end == pytest.approx(P1, abs=1e-12)


def test_speed_scale_is_every_steps() -> None:
    move = sequence(joint(P2), by(0, 0, 0.01, linear_limits=(0.02, 0.05, 0.1)))
    fast, slow = planned(move, FREE).reply, planned(move, FREE, speed_scale=0.5).reply
    assert slow.duration_s == pytest.approx(2.0 * fast.duration_s, rel=1e-9)
