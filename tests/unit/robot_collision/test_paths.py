"""Whole paths: the paper's moves and tool change pass, collisions are found wherever they are between samples."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_motion import synchronise
from axisync_robot.collision import Check, CollisionModel
from axisync_robot.collision_pose import PoseChecker
from axisync_robot.collision_shapes import Shapes
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]

KINGKONG = np.radians([(0, -150, 60, -45, -45, 45), (100, -90, -60, -120, 45, 45)])
WUKONG = np.radians([(0, -60, -60, -60, 90, 0), (20, -40, -40, -40, 110, 20)])
# KingKong's tool change on one branch, tool pointing down: above and at tool 1, above and at tool 2.
A = np.radians([-132.6665, -115.5952, -88.9136, -123.1098, 52.1039, 113.7179])
B = np.radians([-155.6676, -114.3283, -120.8597, -76.2759, 34.3302, 91.9366])
C = np.radians([-142.5906, -121.6771, -66.248, -134.5659, 43.9543, 106.0762])
D = np.radians([-164.2058, -116.176, -102.3711, -81.7249, 29.2975, 78.7947])


def move(start: Array, end: Array) -> tuple[Array, Array]:
    """The planned move's q[k, 6] and velocities, every 2 ms, with the demo's limits."""
    v_max, a_max, j_max = (np.full(6, np.radians(x)) for x in (30.0, 40.0, 80.0))
    profile = synchronise(end - start, v_max, a_max, j_max)
    sample = profile.sample(np.arange(0.0, profile.duration, 0.002))
    return start + sample[0], sample[1]


def line(*poses: Array, samples: int = 60) -> Array:
    """Straight in joint space from pose to pose."""
    part = np.linspace(0.0, 1.0, samples)[:, None]
    return np.concatenate([a + part * (b - a) for a, b in pairwise(poses)])


def test_the_moves_of_the_demo_are_legal(model: CollisionModel) -> None:
    kingkong, _ = move(*KINGKONG)
    wukong, _ = move(*WUKONG)
    first = model.check_path(kingkong, group="kingkong", rest=[*KINGKONG[0], *WUKONG[0]])
    assert first.clear
    assert first.nearest is not None
    assert first.nearest.pair == ("kingkong link 3", "kingkong link 5")
    assert first.min_distance == pytest.approx(0.0928 - 2 * 0.035, abs=1e-9)
    assert model.check_path(wukong, group="wukong", rest=[*KINGKONG[1], *WUKONG[0]]).clear
    assert model.check_path(
        line(np.concatenate((KINGKONG[0], WUKONG[0])), np.concatenate((KINGKONG[1], WUKONG[1])))
    ).clear
    assert model.check_sweeps({"kingkong": kingkong, "wukong": wukong}).min_distance > 0.15


def test_the_moves_of_the_demo_leave_room_for_what_drives_do_alone(model: CollisionModel) -> None:
    for group, poses in (("kingkong", KINGKONG), ("wukong", WUKONG)):
        q, v = move(*poses)
        spread = np.abs(v) * 7 * 0.002 + v * v / (2.0 * np.radians(90.0))
        rest = [*KINGKONG[0], *WUKONG[0]]
        bare, wide = (
            model.check_path(q, group=group, rest=rest),
            model.check_path(q, group=group, rest=rest, spread=spread),
        )
        assert wide.clear
        assert wide.min_distance < bare.min_distance - 0.003


def test_the_tool_change_is_legal_and_too_deep_a_reach_is_not(model: CollisionModel) -> None:
    rest = np.concatenate((A, WUKONG[0]))
    change = model.check_path(line(A, B, A, C, D, C), group="kingkong", rest=rest)
    assert change.clear
    assert change.nearest is not None
    assert change.nearest.pair == ("kingkong link 6", "equipment")
    assert change.min_distance == pytest.approx(0.015, abs=1e-3)
    deeper = line(C, D + 0.15 * (D - C))
    check = model.check_path(deeper, group="kingkong", rest=rest)
    assert check.violation is not None
    assert check.violation.pair == ("kingkong link 6", "equipment")
    allowed = model.check_path(deeper, group="kingkong", rest=rest, contacts=[("equipment", "kingkong.6")])
    assert allowed.clear
    assert allowed.nearest is not None
    assert allowed.nearest.pair != ("kingkong link 6", "equipment")


def test_two_samples_with_a_collision_between(model: CollisionModel) -> None:
    ends = np.radians([(50, 50, -130, -20, -90, 90), (90, 170, -30, -20, -160, 100)])
    rest = np.concatenate((ends[0], WUKONG[0]))
    for pose in ends:
        near = model.clearance(np.concatenate((pose, WUKONG[0])))
        assert near is not None
        assert near.distance > 0.005
    check = model.check_path(ends, group="kingkong", rest=rest)
    assert check.nearest is not None
    assert check.nearest.pair == ("kingkong link 2", "body")
    assert check.min_distance < 0.0
    assert check.violation is not None
    place = check.violation.places[0]
    assert 0.0 < place < 0.5
    found = model.clearance(np.concatenate((ends[0] + place * (ends[1] - ends[0]), WUKONG[0])))
    assert found is not None
    assert found.distance == pytest.approx(check.violation.distance, abs=1e-5)
    assert found.distance == pytest.approx(0.005, abs=2e-4)  # the first place is where the margin is just lost
    assert found.pair[1] == check.violation.pair[1] == "body"  # links 2 and 3 share the elbow


def agrees(check: Check, distances: Array) -> None:
    """What coal found at dense samples does not contradict the check."""
    least, margin = distances.min(), check.margin
    if least < margin:
        assert not check.clear
    if check.min_distance >= 0.0:
        assert least >= check.min_distance - max(1e-3, 0.05 * check.min_distance) - 1e-5
    if check.clear:
        assert check.min_distance <= least + 1e-2


def test_random_paths_against_coal_at_every_sample(model: CollisionModel) -> None:
    rng = np.random.default_rng(8)
    verdicts: list[bool] = []
    while len(verdicts) < 30:
        start = rng.uniform(-2.9, 2.9, 12)
        if not model.check_path(start[None, :]).clear and len(verdicts) % 3:
            continue  # most random poses collide; two thirds start clear
        q = line(start, start + rng.uniform(-0.7, 0.7, 12), start + rng.uniform(-0.7, 0.7, 12))
        check = model.check_path(q)
        distances = np.array([near.distance for near in map(model.clearance, q) if near is not None])
        agrees(check, distances)
        below = np.flatnonzero(distances < check.margin - 2e-4)
        if check.violation is not None and len(below):
            assert check.violation.places[0] <= below[0]
        verdicts.append(check.clear)
    assert 3 < sum(verdicts) < 27


def test_time_does_not_count_between_two_clocks(model: CollisionModel) -> None:
    """At equal times they never meet; had one been held, they would."""
    kingkong, wukong = KINGKONG[0], WUKONG[0]
    k, w = np.radians([70, -10, 80, 40, -110, 110]), np.radians([-130, -40, 120, 30, 70, -30])
    meeting = model.clearance(np.concatenate((k, w)))
    assert meeting is not None
    assert meeting.distance < 0.0
    first, second = line(kingkong, k, kingkong), line(wukong, w, wukong)
    stay_k, stay_w = np.tile(kingkong, (len(second), 1)), np.tile(wukong, (len(first), 1))
    paths = {"kingkong": np.concatenate((first, stay_k)), "wukong": np.concatenate((stay_w, second))}
    assert model.check_path(np.concatenate(list(paths.values()), axis=1)).clear
    check = model.check_sweeps(paths)
    assert check.violation is not None
    assert {name.split()[0] for name in check.violation.pair} == {"kingkong", "wukong"}
    at = [int(place) for place in check.violation.places]
    there = model.clearance(np.concatenate((paths["kingkong"][at[0]], paths["wukong"][at[1]])))
    assert there is not None
    assert there.distance < 0.02


def test_random_sweeps_against_coal_on_a_grid(cell: Cell, model: CollisionModel) -> None:
    shapes = Shapes.of(cell)
    checker = PoseChecker(shapes)
    skip = [p for p, words in enumerate(model.pairs) if [w.split()[0] for w in words] != ["kingkong", "wukong"]]
    rng = np.random.default_rng(10)
    verdicts: list[bool] = []
    for _ in range(25):
        ends = rng.uniform(-2.0, 2.0, (2, 6)), rng.uniform(-2.0, 2.0, (2, 6))
        k, w = (line(a, a + 0.4 * (b - a), samples=20) for a, b in ends)
        check = model.check_sweeps({"kingkong": k, "wukong": w})
        agrees(check, np.array([checker.nearest(np.concatenate((a, b)), skip)[0] for a in k for b in w]))
        verdicts.append(check.clear)
    assert 3 < sum(verdicts) < 23


def test_spread_covers_every_pose_in_its_box(model: CollisionModel) -> None:
    rng = np.random.default_rng(11)
    q, _ = move(*KINGKONG)
    spread = np.array([0.1, 0.05, 0.1, 0.2, 0.2, 0.2])
    rest = np.concatenate((KINGKONG[0], WUKONG[0]))
    bound = model.check_path(q, margin=0.0, group="kingkong", rest=rest, spread=spread).min_distance
    poses = q[rng.integers(0, len(q), 500)] + spread * rng.choice([-1.0, 1.0], (500, 6))
    nearest = min(n.distance for p in poses if (n := model.clearance(np.concatenate((p, WUKONG[0])))) is not None)
    assert bound - 1e-3 <= nearest


def test_spread_at_one_sample_counts_though_nothing_moves(model: CollisionModel) -> None:
    q = np.tile(np.concatenate((KINGKONG[0], WUKONG[0])), (6, 1))
    spread = np.zeros((6, 12))
    assert model.check_path(q, spread=spread).clear
    spread[1, 3] = 0.5
    assert not model.check_path(q, spread=spread).clear


def test_one_search_finds_what_two_find(model: CollisionModel) -> None:
    rng = np.random.default_rng(12)
    verdicts = set()
    for _ in range(12):
        start = np.concatenate((KINGKONG[0], WUKONG[0])) + rng.uniform(-0.3, 0.3, 12)
        q = line(start, start + rng.uniform(-1.5, 1.5, 12), samples=40)
        wide = rng.uniform(0.0, 0.06, (40, 12))
        cases = [(None, None), (0.0, wide), (0.03, np.full(12, 1e-3))]
        together = model.check_widened(q, cases)
        for found, (margin, spread) in zip(together, cases, strict=True):
            alone = model.check_path(q, margin, spread=spread)
            assert found.clear == alone.clear
            if alone.min_distance >= 0.0:
                assert found.min_distance == pytest.approx(alone.min_distance, abs=1e-3, rel=0.05)
            else:
                assert found.min_distance < 0.0
            if alone.violation is not None:
                assert found.violation == alone.violation
        verdicts.add(tuple(found.clear for found in together))
    assert len(verdicts) > 2


def test_a_margin_is_kept_to_the_resolution(model: CollisionModel) -> None:
    q, _ = move(*KINGKONG)
    rest = np.concatenate((KINGKONG[0], WUKONG[0]))
    assert model.check_path(q, margin=0.0226, group="kingkong", rest=rest).clear
    assert not model.check_path(q, margin=0.0230, group="kingkong", rest=rest).clear


def test_what_does_not_fit_is_refused_in_words(model: CollisionModel) -> None:
    with pytest.raises(ValueError, match=r"\[k, 12\], not \(12,\)"):
        model.check_path(np.zeros(12))
    with pytest.raises(ValueError, match="not the whole cell"):
        model.check_path(np.zeros((2, 6)), group="kingkong")
    with pytest.raises(ValueError, match="finite"):
        model.check_path(np.full((2, 12), np.nan))
    with pytest.raises(ValueError, match="not negative"):
        model.check_path(np.zeros((2, 12)), spread=-0.1)
    with pytest.raises(ValueError, match="margin"):
        model.check_path(np.zeros((2, 12)), margin=-0.1)
    with pytest.raises(ValueError, match="share axes"):
        model.check_sweeps({"kingkong": np.zeros((2, 6)), "both": np.zeros((2, 12))})
    with pytest.raises(ValueError, match="two paths"):
        model.check_sweeps({"kingkong": np.zeros((2, 6))})
    with pytest.raises(KeyError):
        model.check_path(np.zeros((2, 6)), group="nobody")
