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
from axisync_robot.collision_motion import arms_of
from axisync_robot.collision_shapes import Shapes
from axisync_robot.collision_track import Track

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

PARTS = 4
BEGIN_PARTS, BEGIN_WAY = 16, 0.05
"""At most, and m: a path along which some pair moves farther than that is begun in parts."""
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
        if not len(other):
            return self
        return Nodes(
            np.concatenate((self.pair, other.pair)),
            np.concatenate((self.low, other.low)),
            np.concatenate((self.high, other.high)),
        )

    def split(self, motion: Array) -> "Nodes":
        """Quarters of the stretch that moves most, motion[n, t]; every other one stays."""
        row, side = np.arange(len(self)), motion.argmax(axis=1)
        begin, end = self.low[row, side], self.high[row, side]
        edges = begin + np.linspace(0.0, 1.0, PARTS + 1)[:, None] * (end - begin)
        edges[-1] = end
        low, high = np.tile(self.low, (PARTS, 1)), np.tile(self.high, (PARTS, 1))
        every, sides = np.arange(PARTS * len(self)), np.tile(side, PARTS)
        low[every, sides], high[every, sides] = edges[:-1].ravel(), edges[1:].ravel()
        return Nodes(np.tile(self.pair, PARTS), low, high)


@dataclass(frozen=True, slots=True)
class Measured:
    """What is known of n nodes, with each of s spreads."""

    distance: Array
    """[s, n] m at the middle, spread taken off."""
    bound: Array
    """[s, n] m: nowhere in the node is it less."""
    motion: Array
    """[n, t] m: what of the bound is owed to each stretch's length."""


@dataclass(frozen=True, slots=True)
class Place:
    """A pair and where on each path."""

    distance: float
    pair: int
    places: tuple[float, ...]


class Sweep:
    """Tracks over a cell whose other axes stand still."""

    def __init__(self, shapes: Shapes, reach: Array, rest: Array, tracks: Sequence[Track], pairs: Indices) -> None:
        """reach[p, n] as by `pair_reach`; rest[n]: the pose of whatever no track moves; the pairs to be watched.

        All tracks have equally many spreads.
        """
        self.tracks, self._shapes, self._pairs = tracks, shapes, pairs
        self._reach = [reach[:, track.axes] for track in tracks]
        self._ways = [track.travel @ own.T for track, own in zip(tracks, self._reach, strict=True)]
        self._owner = np.array([self._track_of(c.axis) for c in shapes.capsules], dtype=np.intp)
        self._moving = [
            [arm for arm in arms_of(shapes) if self._owner[arm.capsules[0]] == k] for k in range(len(tracks))
        ]
        self._pose = rest
        self._rest = np.zeros((len(shapes.capsules), 2, 3))
        for arm in arms_of(shapes):
            self._rest[arm.capsules] = arm.segments.at(rest[None, arm.axes])[0]

    def _track_of(self, axis: int) -> int:
        return next((k for k, track in enumerate(self.tracks) if axis in track.axes), -1)

    def whole(self) -> Nodes:
        """Every pair with all of every path."""
        size = (len(self._pairs), len(self.tracks))
        return Nodes(self._pairs, np.zeros(size), np.zeros(size) + [track.end for track in self.tracks])

    def begin(self) -> Nodes:
        """Every pair with all of every path; one long path in parts, since few pairs are far enough to need none."""
        nodes = self.whole()
        way = self._ways[0][-1, self._pairs].max(initial=0.0)
        parts = int(min(way / BEGIN_WAY, BEGIN_PARTS))
        if len(self.tracks) > 1 or parts < 2:
            return nodes
        edges = np.linspace(0.0, self.tracks[0].end, parts + 1)
        low, high = (np.repeat(side, len(nodes))[:, None] for side in (edges[:-1], edges[1:]))
        return Nodes(np.tile(nodes.pair, parts), low, high)

    @property
    def spreads(self) -> int:
        """s."""
        return len(self.tracks[0].spreads)

    def measure(self, nodes: Nodes) -> Measured:
        """Distances at the middle of the nodes, and what they can shrink to."""
        middle = (nodes.low + nodes.high) / 2.0
        distance = np.repeat(self._distance(nodes.pair, middle)[None], self.spreads, axis=0)
        bound, motion = distance.copy(), np.empty_like(middle)
        for k, track in enumerate(self.tracks):
            low, high, here = nodes.low[:, k], nodes.high[:, k], middle[:, k]
            reach = self._reach[k][nodes.pair]
            motion[:, k] = self._motion(k, nodes.pair, low, here, high)
            bound -= motion[:, k] + np.einsum("nm,nsm->sn", reach, track.widest(low, high))
            distance -= np.einsum("nm,nsm->sn", reach, track.widest(here, here))
        return Measured(distance, bound, motion)

    def _motion(self, number: int, pair: Indices, low: Array, here: Array, high: Array) -> Array:
        """[n] m: nowhere between `low` and `high` is a pair nearer by more than it is at `here`."""
        ways, three = self._ways[number], np.concatenate((low, here, high))
        before, after, part = self.tracks[number].between(three)
        pairs = np.concatenate((pair, pair, pair))
        gone = ways[before, pairs]
        gone += part * (ways[after, pairs] - gone)
        first, middle, last = gone.reshape(3, -1)
        motion: Array = np.maximum(middle - first, last - middle)
        return motion

    def _distance(self, pair: Indices, middle: Array) -> Array:
        first, second = self._shapes.pairs[pair].T
        poses = [self._poses(k, middle[:, k]) for k in range(len(self.tracks))]
        a = self._segments(first, poses)
        distance = np.empty(len(pair))
        box = second >= len(self._shapes.capsules)
        if box.any():
            turn, middle_of, half = self._shapes.box_arrays
            number = second[box] - len(self._shapes.capsules)
            local = np.einsum("nki,nij->nkj", a[box] - middle_of[number, None], turn[number])
            distance[box] = segment_to_box(local, half[number])
        arm = ~box
        of_arm = [(ends, inverse[arm]) for ends, inverse in poses]
        distance[arm] = segment_to_segment(a[arm], self._segments(second[arm], of_arm))
        radius = self._shapes.radii
        clear: Array = distance - radius[first] - radius[second]
        return clear

    def _poses(self, number: int, places: Array) -> tuple[Array, Indices]:
        """Segments at each different place [u, c, 2, 3], and which of them each node means [n]."""
        different, inverse = np.unique(places, return_inverse=True)
        q = np.repeat(self._pose[None], len(different), axis=0)
        q[:, self.tracks[number].axes] = self.tracks[number].at(different)
        ends = np.repeat(self._rest[None], len(different), axis=0)
        for arm in self._moving[number]:
            ends[:, arm.capsules] = arm.segments.at(q[:, arm.axes])
        return ends, inverse

    def _segments(self, capsule: Indices, poses: list[tuple[Array, Indices]]) -> Array:
        """[n, 2, 3] each capsule at its own track's place, or standing still."""
        ends, inverse = poses[0]
        found: Array = ends[inverse, capsule]
        for k, (ends, inverse) in enumerate(poses[1:], start=1):
            moved = self._owner[capsule] == k
            found[moved] = ends[inverse[moved], capsule[moved]]
        return found


def nearest(sweep: Sweep, tolerance: float, share: float) -> list[tuple[Place | None, float]]:
    """With each spread: the nearest place found and a distance (m) that nothing falls below; (None, inf) for no pair.

    Without spread they differ by at most `tolerance` (m) or `share` of the distance, whichever is more. A search ends
    at the first overlap that it meets: how deep it gets is no use to anyone. What one measures serves all.
    """
    pool, best = sweep.begin(), list[Place | None]([None] * sweep.spreads)
    floor, bounds = np.full(sweep.spreads, math.inf), np.full((sweep.spreads, len(pool)), -np.inf)
    while len(pool):
        order = np.argpartition(bounds.min(axis=0), BATCH) if len(pool) > BATCH else np.arange(len(pool))
        batch, rest = pool.where(order[:BATCH]), order[BATCH:]
        found = sweep.measure(batch)
        near = [_nearer(place, batch, found, which) for which, place in enumerate(best)]
        enough = np.array([_enough(place.distance, tolerance, share) for place in near])[:, None]
        # Once hardly anything moves, what is left is spread, and that halving cannot shrink.
        open_ = (found.bound < enough) & (found.motion.max(axis=1) > tolerance / 16.0)
        wanted = open_.any(axis=0)
        parts = batch.where(wanted).split(found.motion[wanted])
        pool = parts.joined(pool.where(rest))
        bounds = np.concatenate((np.tile(found.bound[:, wanted], PARTS), bounds[:, rest]), axis=1)
        kept = bounds < enough
        for done, at in ((~open_, found.bound), (~kept, bounds)):
            floor = np.minimum(floor, np.where(done, at, math.inf).min(axis=1, initial=math.inf))
        still = np.asarray(kept.any(axis=0), dtype=np.bool_)
        pool, bounds, best = pool.where(still), bounds[:, still], [*near]
    return [(place, _floor(place, least)) for place, least in zip(best, floor.tolist(), strict=True)]


def _enough(distance: float, tolerance: float, share: float) -> float:
    """What a node must be able to fall below to be looked at any more."""
    return distance - max(tolerance, share * distance) if distance >= 0.0 else -math.inf


def _floor(place: Place | None, least: float) -> float:
    return place.distance if place is not None and place.distance < 0.0 else least


def _nearer(best: Place | None, nodes: Nodes, found: Measured, which: int) -> Place:
    at = int(found.distance[which].argmin())
    if best is not None and best.distance <= found.distance[which, at]:
        return best
    return _place(nodes, found, at, which)


def first_below(sweep: Sweep, margin: float, resolution: float, which: int = 0) -> Place | None:
    """The first place that is nearer than `margin` with spread `which`, and the nearest pair there; None: none is.

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
        distance, bound = found.distance[which], found.bound[which]
        at = _earliest(batch, distance, (distance < margin) | (short & (bound < margin)))
        if at is not None and (first is None or _place(batch, found, at, which).places[0] < first.places[0]):
            first, start = _place(batch, found, at, which), batch.low[at]
            if len(start) > 1:
                break
        open_ = (bound < margin) & ~short
        pool = batch.where(open_).split(found.motion[open_]).joined(rest)
        if first is not None:
            pool = pool.where(pool.low[:, 0] < first.places[0])
    return None if first is None else _worst_at(sweep, (start, np.array(first.places)), margin, which) or first


def _earliest(nodes: Nodes, distance: Array, bad: NDArray[np.bool_]) -> int | None:
    numbers = np.flatnonzero(bad)
    if not len(numbers):
        return None
    middle = (nodes.low[numbers, 0] + nodes.high[numbers, 0]) / 2.0
    return int(numbers[np.lexsort((distance[numbers], middle))[0]])


def _worst_at(sweep: Sweep, candidates: Sequence[Array], margin: float, which: int) -> Place | None:
    """The nearest pair at the first of these places where the margin is not kept."""
    for places in candidates:
        nodes = sweep.whole()
        nodes.low[:], nodes.high[:] = places, places
        found = sweep.measure(nodes)
        worst = int(found.distance[which].argmin())
        if found.distance[which, worst] < margin:
            return _place(nodes, found, worst, which)
    return None


def _place(nodes: Nodes, found: Measured, at: int, which: int) -> Place:
    middle = (nodes.low[at] + nodes.high[at]) / 2.0
    return Place(float(found.distance[which, at]), int(nodes.pair[at]), tuple(middle.tolist()))
