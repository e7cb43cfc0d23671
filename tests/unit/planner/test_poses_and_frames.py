"""What poses are given in, how they are refused, and how joint moves reach them."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from axisync_schemas.errors import ErrorCode
from support.planner_jobs import FREE, MOVE, P1, PAPER, WUKONG, at, by, linear, planned, refused, trajectory_of, usage

Array = NDArray[np.float64]
ARM = FREE.members("kingkong")[0].kinematics()
DOWN = (0.0, 1.0, 0.0, 0.0)


def end_of(move: Any, start: tuple[float, ...] = PAPER) -> Array:
    return ARM.placement(planned(move, start=start).reply.end)


@pytest.mark.parametrize("frame", ["base", "body", "tool"])
def test_a_relative_line_is_along_the_axes_of_its_frame(frame: str) -> None:
    tool = ARM.placement(PAPER)
    axes = {"base": ARM.base[:3, :3], "body": np.eye(3), "tool": tool[:3, :3]}[frame]
    offset = np.array([0.01, 0.02, -0.03])
    end = end_of(by(*offset, frame=frame))
    assert end[:3, 3] == pytest.approx(tool[:3, 3] + axes @ offset, abs=1e-9)
    assert end[:3, :3] == pytest.approx(tool[:3, :3], abs=1e-9)


@pytest.mark.parametrize("frame", ["base", "body", "tool"])
def test_a_relative_turn_is_about_the_axes_of_its_frame(frame: str) -> None:
    tool = ARM.placement(PAPER)
    axes = {"base": ARM.base[:3, :3], "body": np.eye(3), "tool": tool[:3, :3]}[frame]
    turn = 0.2
    pose = at((0, 0, 0), quaternion=(0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2)))
    about = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    end = end_of(linear(pose, relative=True, frame=frame))
    assert end[:3, :3] == pytest.approx(axes @ about @ axes.T @ tool[:3, :3], abs=1e-9)
    assert end[:3, 3] == pytest.approx(tool[:3, 3], abs=1e-9)


@pytest.mark.parametrize("frame", ["base", "body"])
def test_an_absolute_pose_is_in_its_frame(frame: str) -> None:
    wanted = ARM.placement(PAPER)[:3, 3] + [0.02, 0.01, -0.04]
    frames = {"base": ARM.base, "body": np.eye(4)}
    seen = np.linalg.inv(frames[frame]) @ [*wanted, 1.0]
    assert end_of(linear(seen[:3], frame=frame))[:3, 3] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("kind", ["joint", "linear"])
def test_quaternions_are_normalised_within_a_thousandth(kind: str) -> None:
    unit = np.array([0.1, -0.2, 0.05, 0.97])
    unit /= np.linalg.norm(unit)

    def move(factor: float) -> dict[str, Any]:
        pose = at((0, 0, -0.02), quaternion=tuple((unit * factor).tolist()))
        return {"kind": kind, "target": pose, "relative": True}

    exact = planned(move(1.0), start=PAPER).reply.end
    assert planned(move(1.0009), start=PAPER).reply.end == pytest.approx(exact, abs=1e-9)
    for factor in (1.0011, 0.9989, 0.0, 1e200):
        with pytest.raises(ValidationError, match=r"must be 1 within 0\.001"):
            MOVE.validate_python(move(factor), strict=False)


def test_two_orientations_are_one_too_many() -> None:
    with pytest.raises(ValidationError, match="not both"):
        MOVE.validate_python(linear(at((0, 0, 0), quaternion=DOWN, euler_zyz=(0, 0, 0))), strict=False)


@pytest.mark.parametrize("frame", ["base", "body"])
def test_a_joint_move_to_a_pose_ends_there_soonest(frame: str) -> None:
    there = tuple(np.add(PAPER, [0.3, 0.2, -0.3, 0.2, 0.4, -0.5]).tolist())
    pose = np.linalg.inv({"base": ARM.base, "body": np.eye(4)}[frame]) @ ARM.placement(there)
    zyz = np.arctan2(pose[1, 2], pose[0, 2]), math.acos(pose[2, 2]), np.arctan2(pose[2, 1], -pose[2, 0])
    result = planned({"kind": "joint", "target": at(pose[:3, 3], euler_zyz=zyz), "frame": frame}, start=PAPER)
    assert result.reply.end == pytest.approx(there, abs=1e-9)
    assert result.reply.scalars == tuple(f"kingkong.{i}" for i in range(1, 7))
    assert usage(trajectory_of(result)).max() <= 1.0 + 1e-9
    assert tuple(trajectory_of(result).end.tolist()) == result.reply.end


def test_a_joint_move_to_where_the_tool_is() -> None:
    assert planned({"kind": "joint", "target": at((0, 0, 0)), "relative": True}).reply.duration_s < 1e-3


@pytest.mark.parametrize(
    ("move", "start"),
    [
        (linear((0.9, 0.0, 0.3)), P1),
        ({"kind": "joint", "target": at((0.0, 0.0, 1.4))}, P1),
        (by(0.0, 0.0, 0.5, frame="body"), PAPER),
        (by(0.0, 0.3, 0.0, frame="body", orientation="euler_zyz"), PAPER),
    ],
)
def test_what_is_out_of_reach_names_a_pose_that_is_not(move: dict[str, Any], start: tuple[float, ...]) -> None:
    error = refused(move, start=start)
    assert error.code is ErrorCode.UNREACHABLE
    assert error.details["group"] == "kingkong"
    nearest = error.details["nearest_reachable"]
    frame = move.get("frame", "base")
    reached = {"kind": "joint", "target": at(nearest["position"], quaternion=tuple(nearest["quaternion"]))}
    end = ARM.placement(planned(reached | {"frame": frame}, start=start).reply.end)
    seen = np.linalg.inv({"base": ARM.base, "body": np.eye(4)}[frame]) @ end
    assert seen[:3, 3] == pytest.approx(nearest["position"], abs=1e-6)
    here = np.linalg.inv({"base": ARM.base, "body": np.eye(4)}[frame]) @ ARM.placement(start)
    wanted = np.array(move["target"]["position"]) + (here[:3, 3] if move.get("relative") else 0.0)
    assert np.linalg.norm(wanted - seen[:3, 3]) == pytest.approx(error.details["distance_m"], abs=1e-6)


@pytest.mark.parametrize(
    ("move", "group", "words"),
    [
        (linear((0.1, 0.1, 0.1)), "both", "one pose for each of kingkong, wukong"),
        ({"kind": "linear", "target": {"left": at((0, 0, 0))}}, "both", "left is none of kingkong, wukong"),
        ({"kind": "linear", "target": {}}, "both", "at least one of kingkong, wukong"),
        ({"kind": "linear", "target": {"wukong": at((0, 0, 0))}}, "kingkong", "wukong is none of kingkong"),
        ({"kind": "joint", "target": at((0, 0, 0))}, "both", "of one"),
        ({"kind": "circular", "via": at((0, 0, 0)), "target": at((0, 0, 1))}, "both", "of one arm"),
        ({"kind": "path", "curve": {"type": "circle", "centre": (0, 0, 1)}}, "both", "of one arm"),
    ],
)
def test_targets_that_are_not_the_groups(move: dict[str, Any], group: str, words: str) -> None:
    error = refused(move, group=group, start=P1 + WUKONG if group == "both" else P1)
    assert error.code is ErrorCode.INVALID_REQUEST
    assert words in error.message
    assert error.details["errors"][0]["path"].startswith("move") if "errors" in error.details else True


def test_one_arm_of_both() -> None:
    alone = planned(by(0.02, 0.0, -0.03), start=PAPER)
    move = {"kind": "linear", "target": {"kingkong": at((0.02, 0.0, -0.03))}, "relative": True}
    both = planned(move, group="both", start=PAPER + WUKONG)
    assert both.reply.duration_s == pytest.approx(alone.reply.duration_s, rel=1e-9)
    assert both.reply.end[6:] == WUKONG
    q = trajectory_of(both).sample(np.linspace(0.0, both.reply.duration_s, 100))[0]
    assert (np.abs(q[:, 6:] - WUKONG) < 1e-15).all()


@pytest.mark.parametrize(
    ("via", "target", "words"),
    [
        ((0.0, 0.0, 0.02), (0.0, 0.0, 0.05), "collinear"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.05), "start and via"),
        ((0.0, 0.02, 0.05), (0.0, 0.02, 0.05), "via and target"),
        ((0.0, 0.02, 0.05), (0.0, 0.0, 0.0), "start and target"),
    ],
)
def test_arcs_that_are_none(via: tuple[float, ...], target: tuple[float, ...], words: str) -> None:
    here = (np.linalg.inv(ARM.base) @ ARM.placement(P1))[:3, 3]
    error = refused({"kind": "circular", "via": at(here + via), "target": at(here + target)})
    assert error.code is ErrorCode.INVALID_REQUEST
    assert words in error.message


@pytest.mark.parametrize(
    "curve",
    [
        {"type": "circle", "centre": (0.0, 0.0, 0.0)},
        {"type": "circle", "centre": (0.0, 0.03, 0.0), "normal": (0.0, 0.0, 0.0)},
        {"type": "circle", "centre": (0.0, 0.03, 0.0), "angle": 0.0},
        {"type": "circle", "centre": (1e200, 0.0, 0.0)},
        {"type": "helix", "centre": (0.0, 0.03, 0.0), "pitch": 1e300},
        {"type": "lissajous", "amplitude": (0.0, 0.0, 0.0), "frequency": (1.0, 1.0, 1.0)},
        {"type": "lissajous", "amplitude": (0.01, 0.0, 0.0), "frequency": (1.0, 0.0, 0.0)},
        {"type": "lissajous", "amplitude": (0.01, 0.01, 0.0), "frequency": (1e9, 1.0, 0.0)},
    ],
)
def test_curves_that_are_none(curve: dict[str, Any]) -> None:
    error = refused({"kind": "path", "curve": curve, "frame": "tool"})
    assert error.code is ErrorCode.INVALID_REQUEST
    assert error.details["errors"][0]["path"] == "move"


def test_the_wrist_shoulder_and_elbow_singularities_are_named() -> None:
    def pose(degrees: list[float]) -> dict[str, Any]:
        placed = np.linalg.inv(ARM.base) @ ARM.placement(np.radians(degrees))
        zyz = np.arctan2(placed[1, 2], placed[0, 2]), math.acos(placed[2, 2]), np.arctan2(placed[2, 1], -placed[2, 0])
        return linear(at(placed[:3, 3], euler_zyz=tuple(map(float, zyz))))

    wrist = refused(pose([40, -113, 55, 20, -15, 73]), start=tuple(np.radians([40.0, -113, 55, 39, 15, 86])))
    shoulder = refused(by(0.05, 0.0, 0.05), start=P1)
    near = refused(pose([16, -74, 69, 68, -15, -22]), start=tuple(np.radians([16.0, -74, 69, 50, 15, -10])))
    assert {error.code for error in (wrist, shoulder, near)} == {ErrorCode.SINGULAR_PATH}
    assert wrist.details["singularity"] == "wrist"
    assert shoulder.details["singularity"] == "shoulder"
    assert near.details["scale"] > near.details["scale_max"]
    assert near.details["singularity"] == "wrist"
    for error in (wrist, shoulder, near):
        assert 0.0 < error.details["time_s"] < 5.0


def test_a_soft_limit_on_the_way() -> None:
    start = tuple(np.radians([-65.0, 109, -125, 51, 15, -78]))
    turn = np.radians(100.0) / 2
    move = linear(at((0, 0, 0), quaternion=(0, 0, -math.sin(turn), math.cos(turn))), relative=True, frame="tool")
    error = refused(move, start=start)
    assert error.code is ErrorCode.SOFT_LIMIT
    axis = error.details["axis"]
    assert axis == "kingkong.6"
    low, high = FREE.axes("kingkong")[5].soft_limits
    assert error.details["limits"] == [low, high]
    assert error.details["bound"] in (low, high)
    assert not low <= error.details["value"] <= high
    assert 0.0 < error.details["time_s"] < 10.0


def test_a_start_beyond_its_soft_limit_may_be_left_but_not_gone_further_from() -> None:
    start = (math.radians(172.0), *P1[1:])
    angle = 0.02
    turns = {sign: (0.0, 0.0, math.sin(sign * angle / 2), math.cos(angle / 2)) for sign in (-1, 1)}
    here = (np.linalg.inv(ARM.base) @ ARM.placement(start))[:3, 3]

    def around(sign: int) -> dict[str, Any]:
        c, s = math.cos(angle), math.sin(sign * angle)
        moved = (c * here[0] - s * here[1], s * here[0] + c * here[1], here[2])
        turned = at(np.array(moved) - here, quaternion=turns[sign])
        return linear(turned, relative=True)

    assert planned(around(-1), start=start).reply.end[0] < start[0]
    error = refused(around(1), start=start)
    assert (error.code, error.details["axis"]) == (ErrorCode.SOFT_LIMIT, "kingkong.1")
    back = planned({"kind": "joint", "target": (-0.1, 0, 0, 0, 0, 0), "relative": True}, start=start)
    assert back.reply.end[0] == start[0] - 0.1
