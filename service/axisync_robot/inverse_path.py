"""Following a UR arm along a path of poses: one branch, and another one where joints go on smoothly only so.

A branch ends where the wrist goes straight through its singularity (q5 through 0): beyond it the labels of the two
wrists change places. Which one goes on is read off the joints' steps (axisync_robot.inverse_crossing).
"""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_robot.inverse_crossing import Crossing, crossing_at
from axisync_robot.inverse_errors import (
    BranchChange,
    LimitReached,
    PathRefused,
    Singular,
    StartsElsewhere,
    Unreachable,
)
from axisync_robot.inverse_nearest import nearest_reachable
from axisync_robot.poses import distances
from axisync_robot.ur_inverse import UrInverse, wrapped

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STEP_MAX = 0.35
"""rad: joints of neighbouring samples that differ by more have jumped; paths are sampled far finer."""
START_TOLERANCE = 1e-6
"""m and rad: how far from the first pose the start configuration may stand."""
_MEET = 1e-5
"""rad: branches at the start closer than this are one there, and any may be the one to follow."""
_LIMIT_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Ended:
    """Why a path is not followed any farther: `joint` is at its limit; or else the tool is at the end of its reach, or
    there is a singularity."""

    joint: int | None = None
    singular: bool = False


@dataclass(frozen=True, slots=True)
class Followed:
    """Joint angles [k, n], rad, continuous from the start configuration; `branch` at the start, 0 to 7, None for
    numeric ones; `ended`: None where the whole path is followed."""

    angles: Array
    branch: int | None
    ended: Ended | None = None


@dataclass(frozen=True, eq=False)
class _Problem:
    """Poses [k, 4, 4] and start [6], solved without regard to limits: continuity decides, limits are checked along the
    track. Nearly always one branch is all that is needed; so each is solved when it is asked for."""

    inverse: UrInverse
    poses: Array
    start: Array
    step_max: float
    _branches: dict[int, tuple[Array, Mask, Mask]] = field(default_factory=dict)

    def branch(self, number: int) -> tuple[Array, Mask, Mask]:
        """Angles [k, 6], reachable and free [k]. From the third branch on, all are solved at once."""
        if number not in self._branches:
            if "every" in vars(self) or len(self._branches) > 1:
                (angles, reachable, free), column = self.every, number
            else:
                (angles, reachable, free), column = self.inverse.solve_unlimited(self.poses, self.start, number), 0
            self._branches[number] = angles[:, column], reachable[:, column], free[:, column]
        return self._branches[number]

    @cached_property
    def every(self) -> tuple[Array, Mask, Mask]:
        """Angles [k, 8, 6], reachable and free [k, 8] of all branches."""
        return self.inverse.solve_unlimited(self.poses, self.start)


def follow_branch(inverse: UrInverse, poses: ArrayLike, start: ArrayLike, step_max: float = STEP_MAX) -> Followed:
    """Joint angles along poses [k, 4, 4] in O from start [6], rad, which stands at the first pose.

    Where branches meet at the start, the one that follows the path farthest is taken. While the wrist is singular q6
    stays as it was before, or turns evenly to where it goes on from there.

    Raises:
        StartsElsewhere: the start is not at the first pose.
        Unreachable, BranchChange, Singular, LimitReached: at the first sample to which the joints cannot go on.
    """
    problem, branch, best = _farthest(inverse, poses, start, step_max)
    if best.count == len(problem.poses):
        return Followed(best.angles, branch)
    raise best.refusal(problem)


def follow_while(inverse: UrInverse, poses: ArrayLike, start: ArrayLike, step_max: float = STEP_MAX) -> Followed:
    """As `follow_branch`, but only as far as that goes: angles [m, n] of the first m <= k poses, and what ends them.

    Raises:
        StartsElsewhere, Unreachable: the start is not at the first pose.
    """
    problem, branch, best = _farthest(inverse, poses, start, step_max)
    return Followed(best.angles[: best.count], branch, best.ended(problem))


def _farthest(
    inverse: UrInverse, poses: ArrayLike, start: ArrayLike, step_max: float
) -> tuple["_Problem", int, "_Track"]:
    """The branch at the start that goes farthest, and how far."""
    targets, first = np.asarray(poses, dtype=np.float64), np.asarray(start, dtype=np.float64)
    apart, turn = (float(x) for x in distances(inverse.forward(first), targets[0]))
    if max(apart, turn) > START_TOLERANCE:
        raise StartsElsewhere(apart, turn, START_TOLERANCE)
    problem = _Problem(inverse, targets, first, step_max)
    angles, reachable, _ = inverse.solve_unlimited(targets[:1], first)
    off = np.abs(angles[0] - first).max(axis=1)
    off[~reachable[0]] = np.inf
    if not np.isfinite(off).any():
        raise unreachable(inverse, targets[0], first, 0)
    branches = np.flatnonzero(off <= off.min() + _MEET).tolist()
    tracks = {branch: _route(problem, branch) for branch in branches}
    branch, best = max(tracks.items(), key=lambda item: (item[1].count, -item[1].travel))
    return problem, branch, best


@dataclass(frozen=True, slots=True)
class _Track:
    """Angles [k, 6] of which the first `count` follow, the last of them on `branch`; how the next one fails."""

    branch: int
    angles: Array
    count: int
    reachable: bool
    step_max: float

    @property
    def travel(self) -> float:
        return float(np.abs(np.diff(self.angles[: self.count], axis=0)).sum())

    @property
    def limited(self) -> bool:
        """What ends it is a joint's limit: nothing else is wrong with sample `count`."""
        step = self.angles[self.count] - self.angles[max(0, self.count - 1)]
        return self.reachable and bool(np.abs(step).max() <= self.step_max)

    def ended(self, problem: _Problem) -> Ended | None:
        """What ends it, found without a search for the nearest reachable pose."""
        if self.count == len(problem.poses):
            return None
        if self.limited:
            return Ended(joint=limit_reached(problem.inverse, self.angles[self.count], self.count).joint)
        return Ended(singular=bool(problem.every[1][self.count].any()))

    def refusal(self, problem: _Problem) -> PathRefused:
        """Why sample `count` fails."""
        at, before, inverse = self.count, self.angles[max(0, self.count - 1)], problem.inverse
        step = self.angles[at] - before
        if self.limited:
            return limit_reached(inverse, self.angles[at], at)
        angles, reachable, _ = problem.every
        if not reachable[at].any():
            return unreachable(inverse, problem.poses[at], before, at)
        steps = wrapped(angles[at] - before)
        sizes = np.where(reachable[at], np.abs(steps).max(axis=1), np.inf)
        other = int(sizes.argmin())
        if other != self.branch and (sizes[other] <= self.step_max or not self.reachable):
            return BranchChange(at, self.branch, other, float(sizes[other]))
        joint = int(np.abs(step).argmax())
        return Singular(at, joint, float(step[joint]), self.step_max, nearest_singularity(inverse, before))


def _route(problem: _Problem, branch: int) -> _Track:
    """The track from the start on this branch, across singularities as far as joints go on smoothly."""
    track = _track(problem, branch, 0, problem.start)
    while track.count < len(problem.poses) and not track.limited:
        angles, reachable, free = problem.every
        found = crossing_at(angles, reachable & ~free, track.angles, track.branch, track.count, problem.step_max)
        if found is None or not (begun := _across(problem, track, found)).count:
            break
        rest = _track(problem, found.branch, found.after, begun.angles[-1])
        if not rest.count and not rest.limited:
            break
        angles = np.concatenate((begun.angles, rest.angles))
        track = _Track(found.branch, angles, found.after + rest.count, rest.reachable, problem.step_max)
    return track


def _across(problem: _Problem, track: _Track, found: Crossing) -> _Track:
    """The track up to the crossing, its singular samples solved anew with q6 in between; `count` 0 where it fails."""
    angles, at = track.angles[: found.after].copy(), np.arange(found.before + 1, found.after)
    if not at.size:
        return _Track(track.branch, angles, found.after, True, problem.step_max)
    again = problem.inverse.solve(problem.poses[at], found.between)
    angles[at] = found.between + wrapped(again.angles[:, track.branch] - found.between)
    kept = bool(again.reachable[:, track.branch].all()) and not _beyond(problem.inverse, angles[at]).any()
    return _Track(track.branch, angles, found.after if kept else 0, True, problem.step_max)


def _track(problem: _Problem, branch: int, first: int, start: Array) -> _Track:
    """From sample `first` on this branch, coming from joint angles start [6]; its samples count from `first`."""
    every, reached, singular = problem.branch(branch)
    angles, reachable, free = every[first:].copy(), reached[first:].copy(), singular[first:]
    if free.any():
        _hold_wrist(problem.inverse, problem.poses[first:], start, branch, angles, reachable, free)
    steps = np.diff(angles, axis=0, prepend=start[None])
    angles = start + np.cumsum(wrapped(steps), axis=0) if reachable.all() else _unwrapped(angles, start, reachable)
    jumps = np.abs(np.diff(angles, axis=0, prepend=start[None])).max(axis=1) > problem.step_max
    failed = ~reachable | jumps | _beyond(problem.inverse, angles)
    count = int(failed.argmax()) if failed.any() else len(angles)
    return _Track(branch, angles, count, bool(reachable[min(count, len(angles) - 1)]), problem.step_max)


def _beyond(inverse: UrInverse, angles: Array) -> NDArray[np.bool_]:
    """[k] some joint is outside its limits."""
    outside = (angles < inverse.low - _LIMIT_ROUNDING) | (angles > inverse.high + _LIMIT_ROUNDING)
    return np.asarray(outside.any(axis=1), dtype=np.bool_)


def _hold_wrist(
    inverse: UrInverse,
    poses: Array,
    start: Array,
    branch: int,
    angles: Array,
    reachable: NDArray[np.bool_],
    free: NDArray[np.bool_],
) -> None:
    """Solves the singular samples anew, with the last sample before each run as reference.

    Where only the path's last sample is singular, q6 goes on to it as before: that is where the path leads.
    """
    plain = ~free & reachable
    last = np.maximum.accumulate(np.where(plain, np.arange(len(free)), -1))
    at = np.flatnonzero(free)
    reference = np.where(last[at, None] >= 0, angles[last[at]], start)
    if free[-1] and len(free) > 3 and plain[-4:-1].all():
        first, second = wrapped(np.diff(angles[-4:-1], axis=0))
        reference[-1] = angles[-2] + 2.0 * second - first
    again = inverse.solve(poses[at], reference)
    angles[at], reachable[at] = again.angles[:, branch], again.reachable[:, branch]


def _unwrapped(angles: Array, start: Array, reachable: NDArray[np.bool_]) -> Array:
    """Continuous up to the first sample out of reach, and as they are from there on."""
    end = int((~reachable).argmax())
    steps = np.diff(angles[:end], axis=0, prepend=start[None])
    return np.vstack([start + np.cumsum(wrapped(steps), axis=0), angles[end:]])


def limit_reached(inverse: UrInverse, angles: Array, sample: int) -> LimitReached:
    """The refusal of joint angles [n] beyond the limits: the joint that is farthest beyond."""
    excess = np.maximum(inverse.low - angles, angles - inverse.high)
    joint = int(excess.argmax())
    value = float(angles[joint])
    bound = inverse.low[joint] if value < inverse.low[joint] else inverse.high[joint]
    return LimitReached(sample, joint, value, float(bound))


def unreachable(inverse: UrInverse, pose: Array, reference: Array, sample: int) -> Unreachable:
    """The refusal of pose [4, 4], with the nearest one that is reached, in a configuration near reference [n]."""
    found = nearest_reachable(inverse, pose, reference)
    if found is not None:
        return Unreachable(sample, found.distance, found.pose)
    at = inverse.forward(reference)
    apart, turn = distances(at, pose)
    return Unreachable(sample, float(apart), at, float(turn))


def nearest_singularity(inverse: UrInverse, angles: Array) -> str:
    """Which of the three is nearest, by its sine (the shoulder's: the wrist centre's offset ahead over the reach)."""
    g, q = inverse.geometry, inverse.geometry.angles(angles)
    phi = q[1] + q[2] + q[3]
    ahead = g.a2 * math.cos(q[1]) + g.a3 * math.cos(q[1] + q[2]) + g.d5 * math.sin(phi)
    sizes = {"shoulder": abs(ahead) / g.longest, "elbow": abs(math.sin(q[2])), "wrist": abs(math.sin(q[4]))}
    return min(sizes, key=lambda name: sizes[name])
