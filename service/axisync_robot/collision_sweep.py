"""Nearest approach along one path, or of two paths whose clocks are their own: by halving, with sound bounds.

A node is a pair of shapes and a stretch of each path. The pair's distance is measured at the middle of the stretches.
Elsewhere on them it is smaller by at most the sum over the axes of |turn from the middle| times what a radian of that
axis can do to the pair. Where that bound is good enough the node is done; else the stretch that moves more is
quartered. So nothing slips between samples, few places are looked at, and two paths are compared whole against whole:
each stretch of one against each of the other.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_robot.collision_distance import segment_to_box, segment_to_segment
from axisync_robot.collision_motion import ArmSegments
from axisync_robot.collision_shapes import Shapes
from axisync_robot.collision_track import Track

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

PARTS = 4
BATCH = 4096
"""Nodes measured at once: enough for numpy to be fast, few enough that the best come first."""


@dataclass(frozen=True, slots=True)
class Nodes:
    """n nodes over t tracks."""

    pair: Indices
    low: Array
    """[n, t]."""
    high: Array
    """[n, t]."""

    def __len__(self) -> int:
        return len(self.pair)

    def where(self, kept: NDArray[np.bool_] | Indices) -> "Nodes":
        """Some of them."""
        return Nodes(self.pair[kept], self.low[kept], self.high[kept])

    def joined(self, other: "Nodes") -> "Nodes":
        """Both."""
        return Nodes(
            np.concatenate((self.pair, other.pair)),
            np.concatenate((self.low, other.low)),
            np.concatenate((self.high, other.high)),
        )

    def split(self, motion: Array) -> "Nodes":
        """Quarters of the stretch that moves most, motion[n, t]; every other one stays."""
        row, side = np.arange(len(self)), motion.argmax(axis=1)
        edges = np.linspace(self.low[row, side], self.high[row, side], PARTS + 1)
        low, high = np.tile(self.low, (PARTS, 1)), np.tile(self.high, (PARTS, 1))
        every, sides = np.arange(PARTS * len(self)), np.tile(side, PARTS)
        low[every, sides], high[every, sides] = edges[:-1].ravel(), edges[1:].ravel()
        return Nodes(np.tile(self.pair, PARTS), low, high)


@dataclass(frozen=True, slots=True)
class Measured:
    """What is known of n nodes."""

    distance: Array
    """[n] m at the middle, spread taken off."""
    bound: Array
    """[n] m: nowhere in the node is it less."""
    motion: Array
    """[n, t] m: what of the bound is owed to each stretch's length."""


@dataclass(frozen=True, slots=True)
class Place:
    """A pair and where on each path."""

    distance: float
    pair: int
    places: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Arm:
    segments: ArmSegments
    capsules: Indices
    """Which capsules of the cell they are."""
    axes: Indices


class Sweep:
    """Tracks over a cell whose other axes stand still."""

    def __init__(self, shapes: Shapes, reach: Array, rest: Array, tracks: Sequence[Track], pairs: Indices) -> None:
        """reach[p, n] as by `pair_reach`; rest[n]: the pose of whatever no track moves; the pairs to be watched."""
        self._shapes, self._tracks, self._pairs = shapes, tracks, pairs
        self._reach = [reach[:, track.axes] for track in tracks]
        self._radius = np.array([c.radius for c in shapes.capsules] + [0.0] * len(shapes.boxes))
        self._owner = np.array([self._track_of(c.axis) for c in shapes.capsules], dtype=np.intp)
        self._moving = [self._arms(k) for k in range(len(tracks))]
        self._pose, self._rest = rest, self._ends(self._arms(None), rest[None, :])[0]
        self._half = np.array([b.half for b in shapes.boxes]).reshape(-1, 3)
        self._turn = np.array([b.rotation for b in shapes.boxes]).reshape(-1, 3, 3)
        self._middle = np.array([b.position for b in shapes.boxes]).reshape(-1, 3)

    def _track_of(self, axis: int) -> int:
        return next((k for k, track in enumerate(self._tracks) if axis in track.axes), -1)

    def _arm(self, number: int, track: int | None) -> _Arm | None:
        """An arm with those of its capsules that a track moves (None: with all)."""
        cell, capsules = self._shapes.cell, self._shapes.capsules
        own = [i for i, c in enumerate(capsules) if c.group == number and track in (None, self._owner[i])]
        if not own:
            return None
        group = cell.groups[number]
        arm = ArmSegments(group.base, self._shapes.chain(number), [capsules[i] for i in own])
        return _Arm(arm, np.array(own), np.array(cell.axis_indices(group.name)))

    def _arms(self, track: int | None) -> list[_Arm]:
        found = (self._arm(number, track) for number in range(len(self._shapes.cell.groups)))
        return [arm for arm in found if arm is not None]

    def _ends(self, arms: list[_Arm], q: Array) -> Array:
        """[u, c, 2, 3] segments at q[u, n]; those of other arms are left undefined."""
        ends = np.empty((len(q), len(self._shapes.capsules), 2, 3))
        for arm in arms:
            ends[:, arm.capsules] = arm.segments.at(q[:, arm.axes])
        return ends

    def whole(self) -> Nodes:
        """Every pair with all of every path."""
        size = (len(self._pairs), len(self._tracks))
        return Nodes(self._pairs, np.zeros(size), np.zeros(size) + [track.end for track in self._tracks])

    def measure(self, nodes: Nodes) -> Measured:
        """Distances at the middle of the nodes, and what they can shrink to."""
        middle = (nodes.low + nodes.high) / 2.0
        distance = self._distance(nodes.pair, middle)
        motion = np.empty_like(middle)
        bound = distance.copy()
        for k, track in enumerate(self._tracks):
            low, high, here = nodes.low[:, k], nodes.high[:, k], middle[:, k]
            reach = self._reach[k][nodes.pair]
            motion[:, k] = np.einsum("ij,ij->i", reach, track.turn(low, here, high))
            bound -= motion[:, k] + np.einsum("ij,ij->i", reach, track.widest(low, high))
            distance = distance - np.einsum("ij,ij->i", reach, track.widest(here, here))
        return Measured(distance, bound, motion)

    def _distance(self, pair: Indices, middle: Array) -> Array:
        first, second = self._shapes.pairs[pair].T
        poses = [self._poses(k, middle[:, k]) for k in range(len(self._tracks))]
        a = self._segments(first, poses)
        distance = np.empty(len(pair))
        box = second >= len(self._shapes.capsules)
        if box.any():
            number = second[box] - len(self._shapes.capsules)
            local = np.einsum("nki,nij->nkj", a[box] - self._middle[number][:, None, :], self._turn[number])
            distance[box] = segment_to_box(local, self._half[number])
        arm = ~box
        of_arm = [(ends, inverse[arm]) for ends, inverse in poses]
        distance[arm] = segment_to_segment(a[arm], self._segments(second[arm], of_arm))
        clear: Array = distance - self._radius[first] - self._radius[second]
        return clear

    def _poses(self, number: int, places: Array) -> tuple[Array, Indices]:
        """Segments at each different place [u, c, 2, 3], and which of them each node means [n]."""
        different, inverse = np.unique(places, return_inverse=True)
        q = np.tile(self._pose, (len(different), 1))
        q[:, self._tracks[number].axes] = self._tracks[number].at(different)
        return self._ends(self._moving[number], q), inverse

    def _segments(self, capsule: Indices, poses: list[tuple[Array, Indices]]) -> Array:
        """[n, 2, 3] each capsule at its own track's place, or standing still."""
        found: Array = self._rest[capsule]
        for k, (ends, inverse) in enumerate(poses):
            moved = self._owner[capsule] == k
            found[moved] = ends[inverse[moved], capsule[moved]]
        return found


def nearest(sweep: Sweep, tolerance: float, share: float) -> tuple[Place | None, float]:
    """The nearest place found and a distance (m) that nothing falls below; (None, inf) where there is no pair.

    Without spread they differ by at most `tolerance` (m) or `share` of the distance, whichever is more. The search ends
    at the first overlap that it meets: how deep it gets is no use to anyone.
    """
    pool, best, floor = sweep.whole(), None, math.inf
    bounds = np.full(len(pool), -np.inf)
    while len(pool):
        order = np.argpartition(bounds, BATCH)[:BATCH] if len(pool) > BATCH else np.arange(len(pool))
        batch, rest = pool.where(order), np.delete(np.arange(len(pool)), order)
        found = sweep.measure(batch)
        best = _nearer(best, batch, found)
        if best.distance < 0.0:
            return best, best.distance
        enough = best.distance - max(tolerance, share * best.distance)
        # Once hardly anything moves, what is left is spread, and that halving cannot shrink.
        open_ = (found.bound < enough) & (found.motion.max(axis=1) > tolerance / 16.0)
        parts = batch.where(open_).split(found.motion[open_])
        pool = parts.joined(pool.where(rest))
        bounds = np.concatenate((np.tile(found.bound[open_], PARTS), bounds[rest]))
        kept = bounds < enough
        floor = min(floor, found.bound[~open_].min(initial=math.inf), bounds[~kept].min(initial=math.inf))
        pool, bounds = pool.where(kept), bounds[kept]
    return best, floor


def _nearer(best: Place | None, nodes: Nodes, found: Measured) -> Place:
    at = int(found.distance.argmin())
    if best is not None and best.distance <= found.distance[at]:
        return best
    return _place(nodes, found, at)


def first_below(sweep: Sweep, margin: float, resolution: float) -> Place | None:
    """The first place that is nearer than `margin`, and the nearest pair there; None: none is.

    With two tracks it is any such place: first on one need not be first on the other.

    Sound: where a stretch that moves shapes by less than `resolution` (m) cannot be shown to keep the margin, it counts
    as a place that does not.
    """
    pool, first, start = sweep.whole(), None, np.empty(0)
    while len(pool):
        order = np.argsort(pool.low[:, 0], kind="stable")
        batch, rest = pool.where(order[:BATCH]), pool.where(order[BATCH:])
        found = sweep.measure(batch)
        short = found.motion.sum(axis=1) <= resolution
        at = _earliest(batch, found, (found.distance < margin) | (short & (found.bound < margin)))
        if at is not None and (first is None or _place(batch, found, at).places[0] < first.places[0]):
            first, start = _place(batch, found, at), batch.low[at]
            if len(start) > 1:
                break
        open_ = (found.bound < margin) & ~short
        pool = batch.where(open_).split(found.motion[open_]).joined(rest)
        if first is not None:
            pool = pool.where(pool.low[:, 0] < first.places[0])
    return None if first is None else _worst_at(sweep, (start, np.array(first.places)), margin) or first


def _earliest(nodes: Nodes, found: Measured, bad: NDArray[np.bool_]) -> int | None:
    numbers = np.flatnonzero(bad)
    if not len(numbers):
        return None
    middle = (nodes.low[numbers, 0] + nodes.high[numbers, 0]) / 2.0
    return int(numbers[np.lexsort((found.distance[numbers], middle))[0]])


def _worst_at(sweep: Sweep, candidates: Sequence[Array], margin: float) -> Place | None:
    """The nearest pair at the first of these places where the margin is not kept."""
    for places in candidates:
        nodes = sweep.whole()
        nodes.low[:], nodes.high[:] = places, places
        found = sweep.measure(nodes)
        worst = int(found.distance.argmin())
        if found.distance[worst] < margin:
            return _place(nodes, found, worst)
    return None


def _place(nodes: Nodes, found: Measured, at: int) -> Place:
    middle = (nodes.low[at] + nodes.high[at]) / 2.0
    return Place(float(found.distance[at]), int(nodes.pair[at]), tuple(middle.tolist()))
