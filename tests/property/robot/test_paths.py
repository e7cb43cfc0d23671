"""What every path keeps: its ends, unit speed by length, the shortest turn."""

import math
from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from axisync_robot.paths import Orientation, PathError, ToolPath, arc, circle, line, lissajous
from axisync_robot.paths_errors import Cusp
from axisync_robot.poses import distances, pose_of_zyz, rotation_of_zyz

Array = NDArray[np.float64]

TAPS = np.arange(-4, 5)
STENCIL = np.array([3.0, -32.0, 168.0, -672.0, 0.0, 672.0, -168.0, 32.0, -3.0]) / 840.0
"""First derivative, error of the eighth order."""

coordinate = st.one_of(st.floats(-1.5, 1.5), st.sampled_from([0.0, 0.25, -1.0]))
right = st.integers(-4, 4).map(lambda n: n * math.pi / 2)
angle = st.one_of(st.floats(-7.0, 7.0), right, right.map(lambda x: x + 1e-13), right.map(lambda x: x - 1e-7))
vectors = st.lists(coordinate, min_size=3, max_size=3).map(np.array)
triples = st.lists(angle, min_size=3, max_size=3).map(np.array)
regular = st.tuples(angle, st.floats(1e-6, math.pi - 1e-6), angle, st.sampled_from([-1, 1])).map(
    lambda t: np.array([t[0], t[1] * t[3], t[2]])
)
"""Angles where ZYZ is not singular."""
poses = st.builds(pose_of_zyz, vectors, triples)
orientations = st.sampled_from(["rotation_vector", "euler_zyz"])
common = settings(max_examples=100, deadline=None)


def attempted(make: Callable[[], ToolPath]) -> ToolPath | PathError:
    try:
        return make()
    except PathError as refused:
        return refused


def positions(path: ToolPath, lengths: Array) -> Array:
    values = np.zeros((lengths.size, len(path.distances)))
    values[:, 0] = lengths
    return path.poses(values)[:, :3, 3]


def check_ends(path: ToolPath) -> None:
    ends = path.poses(np.stack([np.zeros_like(path.distances), path.distances]))
    assert np.abs(ends - np.stack([path.start, path.end])).max() < 1e-15
    assert path.distances[0] >= 0.0
    assert np.isfinite(path.distances).all()


def check_rigid(path: ToolPath) -> None:
    """ZYZ angles count as singular within 1e-12 of it; their rounding there is taken away along the path."""
    r = path.poses(np.linspace(0.0, 1.0, 33)[:, None] * path.distances)[:, :3, :3]
    assert np.abs(np.swapaxes(r, 1, 2) @ r - np.eye(3)).max() < (3e-15 if "rotation" in path.names else 2e-12)
    assert np.linalg.det(r).min() > 0.0


def check_unit_speed(path: ToolPath, step: float) -> None:
    length = float(path.distances[0])
    if length < 10 * step:
        return
    centres = np.linspace(4 * step, length - 4 * step, 40)
    track = positions(path, (centres[:, None] + step * TAPS).ravel()).reshape(-1, 9, 3)
    speed = np.linalg.norm(np.einsum("kti,t->ki", track, STENCIL), axis=1) / step
    # Differences show the rounding of the positions as well.
    assert np.abs(speed - 1.0).max() < 1e-9 + 2e-15 / step


@common
@given(start=poses, target=poses, orientation=orientations)
def test_lines(start: Array, target: Array, orientation: Orientation) -> None:
    path = line(start, target, orientation)
    assert np.array_equal(path.end, target)
    check_ends(path)
    check_rigid(path)
    check_unit_speed(path, 1e-3)


@common
@given(start=poses, target=poses)
def test_the_rotation_vector_is_the_shortest_way_at_constant_speed(start: Array, target: Array) -> None:
    path = line(start, target)
    whole = float(distances(start, target)[1])
    x = np.linspace(0.0, 1.0, 41)
    turned = path.poses(x[:, None] * path.distances)
    assert np.abs(distances(start, turned)[1] - x * whole).max() < 1e-12
    assert np.abs(distances(turned[:-1], turned[1:])[1] - whole / 40).max() < 1e-12


@common
@given(start=regular, target=regular)
def test_zyz_angles_go_the_least_of_all_their_representations(start: Array, target: Array) -> None:
    origin = np.zeros(3)
    path = line(pose_of_zyz(origin, start), pose_of_zyz(origin, target), "euler_zyz")
    changes = [
        last - first
        for first in (start, start * [1, -1, 1] + [math.pi, 0, math.pi])
        for last in (target, target * [1, -1, 1] + [math.pi, 0, math.pi])
    ]
    totals = [sum(abs(math.remainder(x, math.tau)) for x in change) for change in changes]
    assert abs(np.abs(path.distances[1:]).sum() - min(totals)) < 1e-8
    assert np.abs(path.distances[1:]).max() <= math.pi + 1e-9


@common
@given(start=poses, via=vectors, target=poses, orientation=orientations)
def test_arcs(start: Array, via: Array, target: Array, orientation: Orientation) -> None:
    path = attempted(lambda: arc(start, via, target, orientation))
    if isinstance(path, PathError):
        assert path.value < path.bound
        return
    check_ends(path)
    check_rigid(path)
    chords = [math.dist(start[:3, 3], via), math.dist(via, target[:3, 3])]
    chord = math.dist(start[:3, 3], target[:3, 3])
    sides = np.sort([*chords, chord])
    lengths = np.linspace(0.0, path.distances[0], 401)
    at = float(lengths[np.linalg.norm(positions(path, lengths) - via, axis=1).argmin()])
    step = 1e-4 * float(path.distances[0])
    for _ in range(8):
        here, ahead = positions(path, np.array([at, at + step]))
        at += float((via - here) @ (ahead - here)) / step
    assert 0.0 < at < path.distances[0]
    # Of three points nearly on a line, rounding of their cross product shows by as much.
    flatness = sides[2] / max(sides[0], 1e-6)
    assert math.dist(here, via) < 1e-13 * max(1.0, flatness) * max(1.0, path.distances[0])
    assert path.distances[0] >= chord - 1e-12
    check_unit_speed(path, 1e-3 * min(1.0, path.distances[0]))


@common
@given(
    start=poses, centre=vectors, normal=vectors, turns=st.floats(-3.0, 3.0), pitch=st.floats(-0.2, 0.2),
    end=st.none() | triples, orientation=orientations,
)  # fmt: skip
def test_circles_and_helices(
    start: Array, centre: Array, normal: Array, turns: float, pitch: float, end: Array | None, orientation: Orientation
) -> None:
    rotation = None if end is None else rotation_of_zyz(end)
    path = attempted(lambda: circle(start, centre, normal, turns * math.tau, pitch, rotation, orientation))
    if isinstance(path, PathError):
        assert path.value < path.bound
        return
    check_ends(path)
    check_rigid(path)
    axis = normal / np.linalg.norm(normal)
    track = path.poses(np.linspace(0.0, 1.0, 50)[:, None] * path.distances)[:, :3, 3] - centre
    height = track @ axis
    radius = np.linalg.norm(track - height[:, None] * axis, axis=1)
    assert np.abs(radius - radius[0]).max() < 1e-13
    assert np.abs(height - height[0] - np.linspace(0.0, turns * pitch, 50)).max() < 1e-13
    check_unit_speed(path, 0.02 * min(1.0, float(radius[0])))


@common
@given(
    start=poses,
    amplitude=st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=3).map(np.array),
    frequency=st.lists(st.one_of(st.floats(-4.0, 4.0), st.integers(-4, 4)), min_size=3, max_size=3).map(np.array),
    phase=triples,
)
def test_lissajous_curves(start: Array, amplitude: Array, frequency: Array, phase: Array) -> None:
    u = np.linspace(0.0, 1.0, 20001)
    speed = np.linalg.norm(math.tau * frequency * amplitude * np.cos(math.tau * frequency * u[:, None] + phase), axis=1)
    path = attempted(lambda: lissajous(start, amplitude, frequency, phase))
    if isinstance(path, PathError):
        assert path.value < path.bound
        assert not isinstance(path, Cusp) or speed.min() < 1e-2 * speed.max()
        return
    assert speed.min() > 0.99e-3 * speed.max()
    check_ends(path)
    length = float(path.distances[0])
    points = start[:3, 3] + amplitude * (np.sin(math.tau * frequency * u[:, None] + phase) - np.sin(phase))
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert chords.sum() <= length * (1.0 + 1e-12) + 1e-11
    lengths = np.concatenate([[0.0], np.cumsum(chords)]) * (length / chords.sum())
    by_length = path.poses(np.stack([lengths, 0.0 * lengths], axis=-1))
    assert np.abs(by_length[:, :3, 3] - points).max() < 1e-4 * max(1e-3, length)
    if speed.min() > 0.1 * speed.max():
        check_unit_speed(path, 2e-3 * length * float(speed.min() / speed.max()) ** 2)
