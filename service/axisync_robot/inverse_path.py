"""Following one branch of a UR arm along a path of poses."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
from axisync_robot.ur_inverse import UrInverse

Array = NDArray[np.float64]

STEP_MAX = 0.35
"""rad: joints of neighbouring samples that differ by more have jumped; paths are sampled far finer."""
START_TOLERANCE = 1e-6
"""m and rad: how far from the first pose the start configuration may stand."""
_MEET = 1e-5
"""rad: branches at the start closer than this are one there, and any may be the one to follow."""
_LIMIT_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Followed:
    """Joint angles [k, n], rad, continuous from the start configuration; `branch` 0 to 7, None for numeric ones."""

    angles: Array
    branch: int | None


def follow_branch(inverse: UrInverse, poses: ArrayLike, start: ArrayLike, step_max: float = STEP_MAX) -> Followed:
    """Joint angles along poses [k, 4, 4] in O from start [6], rad, which stands at the first pose.

    Where branches meet at the start, the one that follows the path farthest is taken. While the wrist is singular q6
    stays as it was before.

    Raises:
        StartsElsewhere: the start is not at the first pose.
        Unreachable, BranchChange, Singular, LimitReached: at the first sample that this branch cannot go on to.
    """
    targets, first = np.asarray(poses, dtype=np.float64), np.asarray(start, dtype=np.float64)
    apart, turn = (float(x) for x in distances(inverse.forward(first), targets[0]))
    if max(apart, turn) > START_TOLERANCE:
        raise StartsElsewhere(apart, turn, START_TOLERANCE)
    angles, reachable, free = _all_branches(inverse, targets, first)
    off = np.abs(angles[0] - first).max(axis=1)
    off[~reachable[0]] = np.inf
    if not np.isfinite(off).any():
        raise _unreachable(inverse, targets[0], first, 0)
    tracks = [
        _track(inverse, targets, first, branch, (angles[:, branch], reachable[:, branch], free[:, branch]), step_max)
        for branch in np.flatnonzero(off <= off.min() + _MEET).tolist()
    ]
    best = max(tracks, key=lambda track: (track.count, -track.travel))
    if best.count == len(targets):
        return Followed(best.angles, best.branch)
    raise best.refusal(inverse, targets, (angles, reachable))


@dataclass(frozen=True, slots=True)
class _Track:
    """One branch: angles [k, 6] of which the first `count` follow; how the next one fails."""

    branch: int
    angles: Array
    count: int
    reachable: bool
    step_max: float

    @property
    def travel(self) -> float:
        return float(np.abs(np.diff(self.angles[: self.count], axis=0)).sum())

    def refusal(self, inverse: UrInverse, poses: Array, every: tuple[Array, NDArray[np.bool_]]) -> PathRefused:
        """Why sample `count` fails."""
        at, before = self.count, self.angles[max(0, self.count - 1)]
        step = self.angles[at] - before
        if self.reachable and np.abs(step).max() <= self.step_max:
            return _limit(inverse, self.angles[at], at)
        if not every[1][at].any():
            return _unreachable(inverse, poses[at], before, at)
        steps = _wrapped(every[0][at] - before)
        sizes = np.where(every[1][at], np.abs(steps).max(axis=1), np.inf)
        other = int(sizes.argmin())
        if other != self.branch and (sizes[other] <= self.step_max or not self.reachable):
            return BranchChange(at, self.branch, other, float(sizes[other]))
        joint = int(np.abs(step).argmax())
        return Singular(at, joint, float(step[joint]), self.step_max, _nearest_singularity(inverse, before))


def _all_branches(inverse: UrInverse, poses: Array, start: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    found = inverse.solve(poses, start)
    # Nearest the start without regard to limits: continuity decides, limits are checked along the track.
    return start + _wrapped(found.angles - start), found.reachable, found.free


def _track(
    inverse: UrInverse,
    poses: Array,
    start: Array,
    branch: int,
    solved: tuple[Array, NDArray[np.bool_], NDArray[np.bool_]],
    step_max: float,
) -> _Track:
    angles, reachable, free = solved[0].copy(), solved[1].copy(), solved[2]
    if free.any():
        _hold_wrist(inverse, poses, start, branch, angles, reachable, free)
    steps = np.diff(angles, axis=0, prepend=start[None])
    angles = start + np.cumsum(_wrapped(steps), axis=0) if reachable.all() else _unwrapped(angles, start, reachable)
    jumps = np.abs(np.diff(angles, axis=0, prepend=start[None])).max(axis=1) > step_max
    beyond = ((angles < inverse.low - _LIMIT_ROUNDING) | (angles > inverse.high + _LIMIT_ROUNDING)).any(axis=1)
    failed = ~reachable | jumps | beyond
    count = int(failed.argmax()) if failed.any() else len(poses)
    return _Track(branch, angles, count, bool(reachable[min(count, len(poses) - 1)]), step_max)


def _hold_wrist(
    inverse: UrInverse,
    poses: Array,
    start: Array,
    branch: int,
    angles: Array,
    reachable: NDArray[np.bool_],
    free: NDArray[np.bool_],
) -> None:
    """Solves the singular samples anew, with the last sample before each run as reference."""
    last = np.maximum.accumulate(np.where(free | ~reachable, -1, np.arange(len(free))))
    at = np.flatnonzero(free)
    reference = np.where(last[at, None] >= 0, angles[last[at]], start)
    again = inverse.solve(poses[at], reference)
    angles[at], reachable[at] = again.angles[:, branch], again.reachable[:, branch]


def _unwrapped(angles: Array, start: Array, reachable: NDArray[np.bool_]) -> Array:
    """Continuous up to the first sample out of reach, and as they are from there on."""
    end = int((~reachable).argmax())
    steps = np.diff(angles[:end], axis=0, prepend=start[None])
    return np.vstack([start + np.cumsum(_wrapped(steps), axis=0), angles[end:]])


def _wrapped(angle: Array) -> Array:
    return angle - math.tau * np.rint(angle / math.tau)


def _limit(inverse: UrInverse, angles: Array, sample: int) -> LimitReached:
    excess = np.maximum(inverse.low - angles, angles - inverse.high)
    joint = int(excess.argmax())
    value = float(angles[joint])
    bound = inverse.low[joint] if value < inverse.low[joint] else inverse.high[joint]
    return LimitReached(sample, joint, value, float(bound))


def _unreachable(inverse: UrInverse, pose: Array, reference: Array, sample: int) -> Unreachable:
    found = nearest_reachable(inverse, pose, reference)
    if found is not None:
        return Unreachable(sample, found.distance, found.pose)
    at = inverse.forward(reference)
    apart, turn = distances(at, pose)
    return Unreachable(sample, float(apart), at, float(turn))


def _nearest_singularity(inverse: UrInverse, angles: Array) -> str:
    """Which of the three is nearest, by its sine (the shoulder's: the wrist centre's offset ahead over the reach)."""
    g, q = inverse.geometry, angles + np.array(inverse.geometry.theta)
    phi = q[1] + q[2] + q[3]
    ahead = g.a2 * math.cos(q[1]) + g.a3 * math.cos(q[1] + q[2]) + g.d5 * math.sin(phi)
    sizes = {"shoulder": abs(ahead) / g.longest, "elbow": abs(math.sin(q[2])), "wrist": abs(math.sin(q[4]))}
    return min(sizes, key=lambda name: sizes[name])
