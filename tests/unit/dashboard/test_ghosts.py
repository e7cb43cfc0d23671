"""Ghosts: the way of a plan from its segment times and jerks, against the planner's own samples."""

from typing import Any

import numpy as np
import pytest

from axisync_client import deg, mm, moves
from axisync_dashboard.ghosts import POINTS, ghosts_of, joint_way, travelled
from axisync_dashboard.kinematics import arms_of
from axisync_motion import synchronise
from axisync_schemas.cell import read_cell
from axisync_schemas.replies import MoveReply
from support.arms import EOD

CELL = read_cell(EOD)[0]
START = np.radians([0.0, -150.0, 60.0, -45.0, -45.0, 45.0])


def reply_of(start: Any, target: Any, pulse: Any = "constant") -> tuple[MoveReply, Any]:
    profile = synchronise(target - start, [0.5] * 6, [0.7] * 6, [1.4] * 6, pulse=pulse)
    rows = {"T": tuple(map(tuple, profile.T.tolist())), "U": tuple(map(tuple, profile.U.tolist()))}
    reply = MoveReply(
        request_id="r", now_s=0.0, move_id=None, group="kingkong", duration_s=profile.duration,
        scalars=tuple(axis.name for axis in CELL.groups[0].axes), minimum_s=(0.0,) * 6, limiting=None,
        end=tuple(float(value) for value in target), **rows,
    )  # fmt: skip
    return reply, profile


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
def test_the_way_is_the_planners(pulse: str) -> None:
    target = START + np.array([0.9, -0.2, 0.5, 0.0, -0.7, 0.1])
    reply, profile = reply_of(START, target, pulse)
    way = joint_way(reply, START, parabolic=pulse == "parabolic")
    distance = profile.sample(np.linspace(0.0, profile.duration, POINTS))[0]
    np.testing.assert_allclose(way, START + distance, atol=1e-9)
    np.testing.assert_allclose(way[-1], target, atol=1e-12)


def test_nothing_is_travelled_before_and_after() -> None:
    profile = travelled(np.array([1.0] * 7), np.array([1, 0, -1, 0, -1, 0, 1.0]), np.array([0.0, 7.0, 9.0]))
    assert profile[0] == 0.0
    assert profile[1] == profile[2] > 0.0


def test_a_joint_move_curves_and_a_line_is_straight() -> None:
    arm = arms_of(CELL)[0]
    target = START + np.array([0.9, -0.2, 0.5, 0.0, -0.7, 0.1])
    reply, _ = reply_of(START, target)
    groups = {"kingkong": (arm, START)}
    joint = ghosts_of(reply, moves.joint(target), groups)["kingkong"]
    line = ghosts_of(reply, moves.linear(mm(0, 0, 1), euler_zyz=deg(0, 0, 0)), groups)["kingkong"]
    assert joint.end == pytest.approx(tuple(target))
    assert (len(joint.path), len(line.path)) == (POINTS, 2)
    np.testing.assert_allclose([joint.path[0], joint.path[-1]], line.path, atol=2e-4)
    assert ghosts_of(reply, moves.dwell(1.0), groups)["kingkong"].path == ()
    assert ghosts_of(reply, moves.joint(target), {"kingkong": (None, START)})["kingkong"].path == ()
