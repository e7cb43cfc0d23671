"""Joint limits along paths: stretched as needed and no more, or refused with the speed that is possible."""

import math
from typing import Any

import numpy as np
import pytest

from axisync_schemas.errors import ErrorCode
from support.planner_jobs import (
    FREE,
    LIMITS,
    P1,
    PAPER,
    at,
    by,
    degrees,
    dense,
    jumps,
    linear,
    planned,
    refused,
    trajectory_of,
    usage,
)

QUICK = by(0.05, 0.03, -0.05)
"""From PAPER; its joints' limits ask for less speed than the path's allow."""
SLOW = by(0.05, 0.03, -0.05, linear_limits=(0.02, 0.05, 0.1))
BENT = degrees(10, -60, -80, -20, 70, 0)
"""WuKong, away from its singularities."""
HELIX = {"kind": "path", "frame": "tool", "curve": {"type": "helix", "centre": (0.0, 0.03, 0.0), "pitch": 0.01}}
MOVES: dict[str, tuple[dict[str, Any], tuple[float, ...]]] = {
    "line": (QUICK, PAPER),
    "helix": (HELIX, P1),
    "turn": (linear(at((0, 0, 0), quaternion=(0, 0, math.sin(0.2), math.cos(0.2))), relative=True), PAPER),
    "zyz": (linear(at((0.02, 0, -0.03), euler_zyz=(1.8, 1.5, -2.9)), orientation="euler_zyz", relative=True), PAPER),
    "slow": (SLOW, PAPER),
}


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("name", MOVES)
def test_every_joint_keeps_its_limits_and_one_is_at_its_own_where_stretched(name: str, pulse: str) -> None:
    move, start = MOVES[name]
    result = planned(move | {"pulse": pulse}, start=start)
    most = usage(trajectory_of(result))
    assert most.max() <= 1.0 + 1e-9
    if result.reply.scale > 1.0:
        assert most.max() > 0.98
        assert result.reply.limiting in {f"kingkong.{i}" for i in range(1, 7)}
    else:
        assert result.reply.limiting in result.reply.scalars


def test_some_are_stretched_and_some_are_not() -> None:
    scales = {name: planned(move, start=start).reply.scale for name, (move, start) in MOVES.items()}
    assert scales["slow"] == 1.0
    assert min(scales["line"], scales["helix"]) > 1.1


@pytest.mark.parametrize("speed", [1.0, 0.9])
@pytest.mark.parametrize("name", ["line", "helix"])
def test_without_retime_the_speed_that_is_possible_is_named_and_possible(name: str, speed: float) -> None:
    move, start = MOVES[name]
    error = refused(move | {"retime": False}, start=start, speed_scale=speed)
    assert error.code is ErrorCode.JOINT_LIMIT
    assert (
        error.details["required"]
        > error.details["allowed"]
        == LIMITS[["velocity", "acceleration", "jerk"].index(error.details["quantity"])]
    )
    assert 0.0 < error.details["time_s"] < 30.0
    possible = error.details["max_feasible_speed_scale"]
    assert possible < speed
    reply = planned(move | {"retime": False}, start=start, speed_scale=possible).reply
    assert reply.scale == 1.0
    retimed = planned(move, start=start, speed_scale=speed).reply
    assert reply.duration_s == pytest.approx(retimed.duration_s, rel=1e-3)
    again = refused(move | {"retime": False}, start=start, speed_scale=possible * (1.0 + 1e-3))
    assert again.code is ErrorCode.JOINT_LIMIT


def test_what_needs_no_retiming_is_the_same_without() -> None:
    assert planned(SLOW | {"retime": False}, start=PAPER).reply == planned(SLOW, start=PAPER).reply


@pytest.mark.parametrize("speed", [0.5, 0.05])
def test_speed_scale_stretches_the_same_curve(speed: float) -> None:
    fast, slow = planned(SLOW, start=PAPER), planned(SLOW, start=PAPER, speed_scale=speed)
    assert slow.reply.duration_s == pytest.approx(fast.reply.duration_s / speed, rel=1e-12)
    s = np.linspace(0.0, fast.reply.duration_s, 50)
    assert np.abs(trajectory_of(fast).sample(s)[0] - trajectory_of(slow).sample(s / speed)[0]).max() < 1e-9


def test_stretching_is_of_the_reply_too() -> None:
    reply = planned(QUICK, start=PAPER).reply
    assert reply.scale > 1.1
    assert np.array(reply.T).sum(axis=1) == pytest.approx([reply.duration_s] * 2, rel=1e-9)
    v, a, j = 0.15 / reply.scale, 0.2 / reply.scale**2, 0.3 / reply.scale**3
    tj, ta, u = reply.T[0][0], reply.T[0][1], abs(reply.U[0][0])
    assert u <= j * (1 + 1e-9)
    assert u * tj <= a * (1 + 1e-9)
    assert u * tj * (tj + ta) <= v * (1 + 1e-9)


@pytest.mark.parametrize("name", ["line", "helix", "turn"])
def test_parabolic_pulses_have_no_jumps_in_joint_jerk_and_constant_ones_have(name: str) -> None:
    move, start = MOVES[name]
    pulses = ("constant", "parabolic")
    constant, parabolic = (jumps(trajectory_of(planned(move | {"pulse": pulse}, start=start))) for pulse in pulses)
    assert constant[3] > 0.01 * LIMITS[2]
    assert parabolic[3] < 1e-3 * LIMITS[2]
    for found in (constant, parabolic):
        assert (found[:3] < [1e-8, 1e-7, 1e-5]).all()


@pytest.mark.parametrize("duration", [6.0, 20.0, 500.0])
@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
def test_a_duration_is_kept_to_however_the_joints_need_it(duration: float, pulse: str) -> None:
    result = planned(QUICK | {"duration_s": duration, "pulse": pulse}, start=PAPER)
    assert result.reply.duration_s == pytest.approx(duration, rel=1e-12)
    assert usage(trajectory_of(result)).max() <= 1.0 + 1e-9


@pytest.mark.parametrize("share", [0.05, 0.7, 0.999])
def test_too_short_a_duration_names_the_shortest_and_that_is_possible(share: float) -> None:
    """Also where only the joints, and not the path's limits, make it too short."""
    shortest = planned(QUICK, start=PAPER).reply.duration_s
    error = refused(QUICK | {"duration_s": share * shortest}, start=PAPER)
    assert error.code is ErrorCode.INFEASIBLE_DURATION
    assert error.details["shortest_duration_s"] == shortest
    assert planned(QUICK | {"duration_s": shortest}, start=PAPER).reply.duration_s == pytest.approx(shortest, rel=1e-12)


def test_limits_beyond_every_arms_are_refused_with_how_much() -> None:
    error = refused(by(0.05, 0.03, -0.05, linear_limits=(1e6, 1e6, 1e6)), start=PAPER)
    assert error.code is ErrorCode.SINGULAR_PATH
    assert error.details["scale"] > error.details["scale_max"] == 20.0
    assert error.details["axis"].startswith("kingkong.")


@pytest.mark.parametrize("limits", [(1e300, 1.0, 1.0), (1.0, 1e-300, 1.0)])
def test_limits_that_cannot_be_computed_with(limits: tuple[float, ...]) -> None:
    error = refused(by(0.05, 0.03, -0.05, linear_limits=limits), start=PAPER)
    assert error.code is ErrorCode.INVALID_REQUEST


def test_the_cell_files_limits_hold_where_none_are_given() -> None:
    given = by(0.05, 0.03, -0.05, linear_limits=(0.15, 0.2, 0.3), angular_limits=tuple(LIMITS))
    assert planned(given, start=PAPER).reply == planned(QUICK, start=PAPER).reply


def test_two_arms_keep_each_its_limits_and_arrive_together() -> None:
    target = {"kingkong": at((0, 0, 0.05)), "wukong": at((0.03, 0.0, -0.03))}
    result = planned({"kind": "linear", "target": target, "relative": True}, group="both", start=P1 + BENT)
    trajectory, reply = trajectory_of(result), result.reply
    assert reply.scalars == ("kingkong.length", "kingkong.rotation", "wukong.length", "wukong.rotation")
    assert usage(trajectory).max() == pytest.approx(1.0, abs=0.02)
    times = dense(trajectory)
    q, v, *_ = trajectory.sample(times)
    last = np.abs(v).max(axis=0) > 0.0
    assert last.all()
    before = times < reply.duration_s * (1 - 1e-3)
    for arm, columns in ((0, slice(0, 6)), (1, slice(6, 12))):
        kinematics = FREE.members("both")[arm].kinematics()
        tool = kinematics.placements(q[:, columns])[:, :3, 3]
        end = kinematics.placement(np.array(reply.end)[columns])[:3, 3]
        offset = list(target.values())[arm]["position"]
        assert np.abs(end - tool[0] - kinematics.base[:3, :3] @ np.array(offset)).max() < 1e-9
        left = np.linalg.norm(tool[before][-1] - end)
        assert 0.0 < left < 1e-6
        shares = np.linalg.norm(tool - tool[0], axis=1) / np.linalg.norm(offset)
        assert shares[before][-1] < 1.0
