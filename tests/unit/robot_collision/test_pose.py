"""One pose, by coal: against the batch's own distances, on poses known to be clear and known to collide."""

import numpy as np
import pytest
from numpy.typing import NDArray

from axisync_robot.collision import CollisionModel
from axisync_robot.collision_motion import pair_reach
from axisync_robot.collision_pose import PoseChecker
from axisync_robot.collision_shapes import Shapes
from axisync_robot.collision_sweep import Nodes, Sweep
from axisync_robot.collision_track import Track
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]
WUKONG = (0, -60, -60, -60, 90, 0)


def test_coal_and_the_batch_agree(cell: Cell) -> None:
    shapes = Shapes.of(cell)
    every = np.arange(len(shapes.pairs))
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (300, 12))
    sweep = Sweep(shapes, pair_reach(shapes), np.zeros(12), [Track.of(range(12), q, None)], every)
    checker = PoseChecker(shapes)
    for number, pose in enumerate(q):
        place = np.full((len(every), 1), float(number))
        distances = sweep.measure(Nodes(every, place, place)).distance[0]
        theirs, pair = checker.nearest(pose)
        if distances.min() > 0.0:
            assert abs(theirs - distances.min()) < 1e-5  # coal's own tolerance with boxes
            assert distances[pair] < distances.min() + 1e-5
        else:
            assert theirs < 1e-5


@pytest.mark.parametrize(
    ("kingkong", "wukong", "words"),
    [
        ((60, 110, -170, 110, -10, 10), WUKONG, ("kingkong link 2", "kingkong link 3", "body")),
        ((100, 120, -130, -40, 40, 0), WUKONG, ("kingkong link 3", "body")),
        ((-170, 150, -70, 120, 40, 120), WUKONG, ("kingkong link 5", "kingkong link 6", "body")),
        ((-60, 130, -40, -70, 110, -160), (110, -10, -70, -50, -30, 30), ("kingkong link 6", "wukong link 2")),
        ((10, -10, -50, -120, 170, 0), (-70, 40, 50, 110, -150, 110), ("kingkong link 3", "wukong link 3")),
        ((-100, -170, -110, -20, 30, 20), (150, -120, -160, -150, -170, 20), ("kingkong link 6", "wukong link 5")),
    ],
)
def test_colliding_poses_are_caught(
    model: CollisionModel, kingkong: tuple[int, ...], wukong: tuple[int, ...], words: tuple[str, ...]
) -> None:
    q = np.radians([*kingkong, *wukong])
    near = model.clearance(q)
    assert near is not None
    assert near.distance < -0.01
    assert set(near.pair) <= set(words)  # neighbours go equally deep where they meet
    check = model.check_path(q[None, :])
    assert not check.clear


def test_links_3_and_5_keep_what_the_offset_leaves(model: CollisionModel) -> None:
    near = model.clearance(np.radians([0, -150, 60, -45, -45, 45, *WUKONG]))
    assert near is not None
    assert str(near) == "wukong link 3 / wukong link 5: 12.8 mm"
    assert near.distance == pytest.approx(0.0928 - 2 * 0.04, abs=1e-9)


def test_poses_and_contacts_are_checked(model: CollisionModel) -> None:
    with pytest.raises(ValueError, match="12 finite joint angles"):
        model.clearance([0.0] * 6)
    with pytest.raises(ValueError, match="finite"):
        model.clearance([float("nan")] * 12)
    with pytest.raises(ValueError, match=r"no contact between kingkong\.5 and body"):
        model.clearance([0.0] * 12, contacts=[("kingkong.5", "body")])
