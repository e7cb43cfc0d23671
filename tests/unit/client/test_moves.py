import math

import numpy as np
import pytest

from axisync_client import Circle, InvalidArgument, ToolPose, deg, mm, moves, pose
from axisync_schemas.moves import JointMove, LinearMove, PathMove


def test_a_line_with_every_option() -> None:
    move = moves.linear(
        mm(300, 0, 120),
        euler_zyz=deg(0, 90, 0),
        frame="body",
        relative=True,
        linear_limits=np.array([0.1, 0.2, 0.3]),
        angular_limits=deg(30, 40, 80),
        orientation="euler_zyz",
        retime=False,
        minimise="jerk",
        duration_s=9,
        pulse="parabolic",
        contacts=[["kingkong.6", "equipment"]],
    )
    assert move == LinearMove(
        target=ToolPose(position=(0.3, 0.0, 0.12), euler_zyz=(0.0, math.pi / 2, 0.0)),
        frame="body",
        relative=True,
        linear_limits=(0.1, 0.2, 0.3),
        angular_limits=tuple(deg(30, 40, 80).tolist()),
        orientation="euler_zyz",
        retime=False,
        minimise="jerk",
        duration_s=9.0,
        pulse="parabolic",
        contacts=(("kingkong.6", "equipment"),),
    )


def test_defaults_are_those_of_the_models() -> None:
    here = ToolPose(position=(1.0, 0.0, 0.0))
    assert moves.linear([1, 0, 0], quaternion=None, duration_s=None) == LinearMove(target=here)
    assert moves.linear(here) == LinearMove(target=here)
    assert moves.joint([1, 0]) == JointMove(target=(1.0, 0.0))
    assert moves.path(Circle(centre=(0.0, 0.0, 0.0))) == PathMove(curve=Circle(centre=(0.0, 0.0, 0.0)))


def test_poses_for_both_arms_and_for_joints() -> None:
    here = pose(np.zeros(3), quaternion=[0, 0, 0, 1])
    move = moves.linear({"kingkong": here, "wukong": [0, 0, 0.1]})
    assert move.target == {"kingkong": here, "wukong": ToolPose(position=(0.0, 0.0, 0.1))}
    assert moves.joint(here, frame="tool").target == here


def test_an_arc_and_a_curve_with_an_orientation_at_the_end() -> None:
    arc = moves.circular([0, 1, 0], [1, 1, 0], quaternion=[0, 0, 1, 0])
    assert arc.via.quaternion is None
    assert arc.target.quaternion == (0.0, 0.0, 1.0, 0.0)
    assert moves.path(Circle(centre=(0.0, 0.0, 0.0)), euler_zyz=[0, 1, 0]).end.euler_zyz == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: moves.linear([0, 0]), r"^position\[2\]: Field required$"),
        (lambda: moves.linear([0, 0, math.nan]), r"position\[2\]: nan is not finite"),
        (lambda: moves.linear([0, 0, 1], quaternion=[0, 0, 0, 1.1]), r"^quaternion has length 1\.1: must be 1 within"),
        (lambda: pose([0, 0, 1], [0, 0, 0, 1], [0, 0, 0]), "quaternion or euler_zyz, not both"),
        (lambda: moves.linear(pose([0, 0, 1]), euler_zyz=[0, 0, 0]), "euler_zyz: the pose has an orientation"),
        (lambda: moves.linear({"a": [0, 0, 1]}, euler_zyz=[0, 0, 0]), "give each group's target"),
        (lambda: moves.linear([0, 0, 1], linear_limits=[1, 0, 1]), r"linear_limits\[1\]: Input should be greater"),
        (lambda: moves.linear([0, 0, 1], frame="world"), "frame"),
        (lambda: moves.linear([0, 0, 1], speed=3), "speed: Extra inputs"),
        (lambda: moves.joint([0.0] * 65), "target: Tuple should have at most 64"),
        (lambda: moves.joint([0.0], minimise="time"), "minimise"),
        (lambda: moves.joint([0.0], pulse="square"), "pulse"),
        (lambda: moves.joint([0.0], duration_s=-1.0), "duration_s"),
        (lambda: moves.joint([0.0], duration_s=math.nan), "duration_s"),
        (lambda: moves.sequence([]), "steps"),
        (lambda: moves.sequence([moves.dwell(1)] * 257), "steps: Tuple should have at most 256"),
        (lambda: moves.dwell(0), "duration_s"),
    ],
)
def test_what_no_daemon_would_take_names_its_path(ask: object, said: str) -> None:
    with pytest.raises(InvalidArgument, match=said):
        ask()  # type: ignore[operator]
