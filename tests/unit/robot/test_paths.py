"""Paths at places where the answer is known, and every refusal."""

import math
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.paths import Orientation, PathError, ToolPath, arc, circle, line
from axisync_robot.paths_errors import (
    CollinearArcPoints,
    EqualArcPoints,
    OutOfRange,
    StartOnAxis,
    ZeroCurve,
    ZeroNormal,
)
from axisync_robot.poses import pose_of, pose_of_zyz, rotation_of_vector, rotation_of_zyz, vector_of_rotation

Array = NDArray[np.float64]

EYE = np.eye(3)
HOME = pose_of_zyz([0.4, -0.2, 0.6], [0.3, 1.1, -0.4])


def rotation_x(angle: float) -> Array:
    return rotation_of_vector(np.array([angle, 0.0, 0.0]))


def rotation_z(angle: float) -> Array:
    return rotation_of_vector(np.array([0.0, 0.0, angle]))


def along(path: ToolPath, *fractions: float) -> Array:
    return path.poses(np.array(fractions)[:, None] * path.distances)


def at(x: float, y: float, z: float) -> Array:
    return pose_of([x, y, z], EYE)


def test_a_line_is_straight_and_turns_about_one_axis() -> None:
    turn = np.array([0.3, -0.8, 1.2])
    path = line(HOME, pose_of([0.7, 0.2, 0.6], HOME[:3, :3] @ rotation_of_vector(turn)))
    assert path.names == ("length", "rotation")
    assert path.angular.tolist() == [False, True]
    assert path.distances == pytest.approx([0.5, np.linalg.norm(turn)], abs=1e-15)
    poses = along(path, 0.0, 0.25, 1.0)
    assert poses[1, :3, 3] == pytest.approx([0.475, -0.1, 0.6], abs=1e-15)
    assert vector_of_rotation(HOME[:3, :3].T @ poses[1, :3, :3]) == pytest.approx(0.25 * turn, abs=1e-14)


def test_each_scalar_moves_by_itself() -> None:
    path = line(HOME, pose_of_zyz([0.1, 0.3, 0.5], [0.9, 0.4, 0.2]))
    poses = path.poses(np.array([[path.distances[0], 0.0], [0.0, path.distances[1]]]))
    assert np.abs(poses[0] - pose_of(path.end[:3, 3], HOME[:3, :3])).max() < 1e-15
    assert np.abs(poses[1] - pose_of(HOME[:3, 3], path.end[:3, :3])).max() < 1e-15


def test_the_papers_example() -> None:
    start = pose_of_zyz([-0.0928, -0.2528, 0.5710], np.radians([90.0, 75.0, -180.0]))
    target = pose_of_zyz([-0.0928, -0.2528, 0.38], np.radians([120.0, 120.0, -160.0]))
    path = line(start, target, "euler_zyz")
    assert path.names == ("length", "alpha", "beta", "gamma")
    assert path.angular.tolist() == [False, True, True, True]
    assert path.distances[0] == pytest.approx(0.191, abs=1e-15)
    assert np.degrees(path.distances[1:]) == pytest.approx([30.0, 45.0, 20.0], abs=1e-12)
    middle = pose_of_zyz([-0.0928, -0.2528, 0.4755], np.radians([105.0, 97.5, -170.0]))
    assert np.abs(along(path, 0.5)[0] - middle).max() < 1e-15


def test_zyz_takes_the_other_triple_where_it_is_nearer() -> None:
    target = rotation_of_zyz(np.radians([10.0, -20.0, 30.0]))
    path = line(pose_of([0, 0, 0], rotation_of_zyz(np.radians([5.0, 10.0, 20.0]))), pose_of([0, 0, 0], target),
                "euler_zyz")  # fmt: skip
    assert np.degrees(path.distances[1:]) == pytest.approx([5.0, -30.0, 10.0], abs=1e-12)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("beta", [0.0, 180.0])
def test_from_a_singular_orientation_only_alpha_and_beta_turn(beta: float, backwards: bool) -> None:
    ends = [pose_of_zyz([0, 0, 0], np.radians([25.0, beta, 0.0])), pose_of_zyz([0.1, 0, 0], np.radians([40, 100, 70]))]
    path = line(ends[backwards], ends[not backwards], "euler_zyz")
    expected = [40.0 - (25.0 - 70.0 if beta == 0.0 else 25.0 + 70.0), 100.0 - beta, 0.0]
    assert np.degrees(path.distances[1:]) == pytest.approx(np.array(expected) * (-1 if backwards else 1), abs=1e-11)
    assert np.abs(along(path, 0.0, 1.0) - np.stack([path.start, path.end])).max() < 1e-15


@pytest.mark.parametrize("orientation", ["rotation_vector", "euler_zyz"])
def test_tool_down_to_tool_down_turns_about_the_vertical(orientation: Orientation) -> None:
    down = rotation_x(math.pi)
    path = line(pose_of([0, 0, 0], down), pose_of([0.2, 0, 0], rotation_z(0.8) @ down), orientation)
    assert path.distances[1:].tolist() == pytest.approx([0.8] + [0.0] * (len(path.names) - 2), abs=1e-14)
    assert np.abs(along(path, 0.5)[0, :3, :3] - rotation_z(0.4) @ down).max() < 1e-14


def test_half_a_turn_goes_one_way_every_time() -> None:
    target = pose_of([0, 0, 0], rotation_z(math.pi))
    first, second = (along(line(at(0, 0, 0), target), 0.0, 0.3, 1.0) for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert line(at(0, 0, 0), target).distances[1] == pytest.approx(math.pi, abs=1e-15)
    assert abs(first[1, 1, 0]) == pytest.approx(math.sin(0.3 * math.pi), abs=1e-15)


def test_standing_still_and_turning_on_the_spot() -> None:
    still = line(HOME, HOME)
    assert still.distances.tolist() == [0.0, 0.0]
    assert np.array_equal(still.poses(np.zeros((3, 2))), np.stack([HOME] * 3))
    spot = line(HOME, pose_of(HOME[:3, 3], EYE))
    assert spot.distances[0] == 0.0
    assert np.array_equal(along(spot, 0.5)[0, :3, 3], HOME[:3, 3])
    assert still.poses(np.zeros((0, 2))).shape == (0, 4, 4)


def test_the_rounding_of_a_kept_orientation_is_no_rotation() -> None:
    path = line(HOME, pose_of([0.7, 0.2, 0.6], HOME[:3, :3] @ rotation_of_vector(np.array([0.0, 8e-16, 0.0]))))
    assert path.distances[1] == 0.0
    assert np.abs(along(path, 1.0)[0] - path.end).max() < 3e-16


@pytest.mark.parametrize(("via", "angle"), [((0.6, 0.8), 0.5), ((-0.6, -0.8), 1.5), ((-0.6, 0.8), 0.5)])
def test_an_arc_goes_the_way_of_via(via: tuple[float, float], angle: float) -> None:
    """From (1, 0): to (0, 1) directly; to (0, 1) the long way round; to (-1, 0) over the top is half a turn."""
    half_turn = via == (-0.6, 0.8)
    path = arc(at(1, 0, 2), [*via, 2.0], at(-1, 0, 2) if half_turn else at(0, 1, 2))
    turned = math.pi * (1.0 if half_turn else angle)
    assert path.distances[0] == pytest.approx(turned, abs=1e-14)
    positions = along(path, *np.linspace(0.0, 1.0, 101))[:, :3, 3]
    assert np.hypot(positions[:, 0], positions[:, 1]) == pytest.approx(np.ones(101), abs=1e-14)
    way = -1.0 if angle > 1.0 else 1.0
    assert np.unwrap(np.arctan2(positions[:, 1], positions[:, 0])) == pytest.approx(
        np.linspace(0.0, way * turned, 101), abs=1e-13
    )


def test_a_tiny_arc_and_a_flat_one() -> None:
    tiny = arc(at(0.5, 0.5, 0.5), [0.5 + 1e-5, 0.5 + 1e-5, 0.5], at(0.5 + 2e-5, 0.5, 0.5))
    assert tiny.distances[0] == pytest.approx(math.pi * 1e-5, rel=1e-9)
    sagitta = 0.1**2 / (2 * 900.0)
    flat = arc(at(-0.1, 0, 0), [0.0, sagitta, 0.0], at(0.1, 0, 0))
    assert flat.distances[0] == pytest.approx(2 * 900.0 * math.asin(0.1 / 900.0), rel=1e-12)
    assert along(flat, 0.5)[0, :3, 3] == pytest.approx([0.0, sagitta, 0.0], abs=1e-15)


def test_a_circle_turns_right_handed_about_its_normal() -> None:
    path = circle(at(1.5, 0, 1), [0.5, 0, 7], [0, 0, 3], 2.5 * math.tau)
    assert path.distances == pytest.approx([2.5 * math.tau, 0.0], abs=1e-13)
    positions = along(path, 0.1, 1.0)[:, :3, 3]
    assert positions == pytest.approx(np.array([[0.5, 1, 1], [-0.5, 0, 1]]), abs=1e-14)
    back = circle(at(1.5, 0, 1), [0.5, 0, 7], [0, 0, 3], -math.tau)
    assert along(back, 0.25)[0, :3, 3] == pytest.approx([0.5, -1, 1], abs=1e-15)
    assert np.array_equal(along(back, 1.0)[0], at(1.5, 0, 1))
    assert np.array_equal(circle(HOME, [0.5, 0, 7], [1, 2, 3], 100 * math.tau).end, HOME)


def test_a_helix_rises_by_its_pitch_and_turns_the_tool() -> None:
    path = circle(at(0.3, 0, 0), [0, 0, 0], [0, 0, 1], 3 * math.tau, 0.05, rotation_x(0.9))
    assert path.distances == pytest.approx([3 * math.hypot(math.tau * 0.3, 0.05), 0.9], abs=1e-13)
    assert path.end == pytest.approx(pose_of([0.3, 0, 0.15], rotation_x(0.9)), abs=1e-15)
    assert along(path, 0.5)[0] == pytest.approx(pose_of([-0.3, 0, 0.075], rotation_x(0.45)), abs=1e-14)
    down = circle(at(0.3, 0, 0), [0, 0, 0], [0, 0, 1], -math.tau, 0.05)
    assert down.end[:3, 3] == pytest.approx([0.3, 0, -0.05], abs=1e-15)


FAR = at(2e6, 0, 0)

REFUSALS: dict[str, tuple[Callable[[], ToolPath], type[PathError], str]] = {
    "start and target equal": (lambda: arc(HOME, [1, 0, 0], HOME), EqualArcPoints, 'curve "circle"'),
    "via at start": (lambda: arc(at(0, 0, 0), [1e-7, 0, 0], at(1, 0, 0)), EqualArcPoints, "start and via"),
    "via at target": (lambda: arc(at(0, 0, 0), [1, 0, 0], at(1, 0, 0)), EqualArcPoints, "via and target"),
    "collinear": (lambda: arc(at(0, 0, 0), [0.5, 0, 0], at(1, 0, 0)), CollinearArcPoints, "collinear: via is 0 m"),
    "via beyond": (lambda: arc(at(0, 0, 0), [2, 0, 0], at(1, 0, 0)), CollinearArcPoints, "linear move"),
    "flat": (lambda: arc(at(-0.1, 0, 0), [0, 4e-6, 0], at(0.1, 0, 0)), CollinearArcPoints, "4e-06 m from the line"),
    "on the axis": (lambda: circle(at(0, 0, 3), [0, 0, 0], [0, 0, 1], 1.0, 0.1), StartOnAxis, "axis of the circle"),
    "no normal": (lambda: circle(HOME, [0, 0, 0], [0, 0, 0], 1.0), ZeroNormal, "normal has length 0"),
    "no angle": (lambda: circle(HOME, [0, 0, 0], [0, 0, 1], 0.0, 0.1), ZeroCurve, "helix is 0 m long"),
    "too many turns": (lambda: circle(HOME, [0, 0, 0], [0, 0, 1], 629.0), OutOfRange, "angle: 629 rad"),
    "far centre": (lambda: circle(HOME, [1e300, 0, 0], [0, 0, 1], 1.0), OutOfRange, "centre: 1e+300 m"),
    "far target": (lambda: line(HOME, FAR), OutOfRange, "target: 2e+06 m; at most 1e+06 m"),
    "far via": (lambda: arc(HOME, [math.nan, 0, 0], at(1, 0, 0)), OutOfRange, "via: nan m"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals_say_what_is_wrong_and_by_how_much(name: str) -> None:
    make, kind, words = REFUSALS[name]
    with pytest.raises(PathError) as refused:
        make()
    assert type(refused.value) is kind
    assert words in str(refused.value)
    again = pickle.loads(pickle.dumps(refused.value))
    assert str(again) == str(refused.value)
    assert abs(again.value) != again.bound


def test_how_far_from_collinear_is_said_to_the_bound() -> None:
    with pytest.raises(CollinearArcPoints) as refused:
        arc(at(-0.1, 0, 0), [0.0, 4.9e-6, 0.0], at(0.1, 0, 0))
    assert refused.value.value == pytest.approx(4.9e-6, rel=1e-9)
    assert refused.value.radius_max == 1000.0
    assert refused.value.bound == pytest.approx(5e-6, rel=1e-6)
    arc(at(-0.1, 0, 0), [0.0, 1.001 * refused.value.bound, 0.0], at(0.1, 0, 0))
