"""Where the capsules of an arm are at many poses at once, and how far a joint's turn can carry them at most."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from axisync_robot.chain import Chain, base_placement
from axisync_robot.collision_shapes import LinkCapsule, Shapes
from axisync_robot.kernels import kernels
from axisync_schemas.cell import Pose

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class ArmSegments:
    """The segments of one arm's capsules, many poses at once: fewer and larger numpy calls than pose by pose."""

    def __init__(self, base: Pose, chain: Chain, capsules: Sequence[LinkCapsule]) -> None:
        """Capsules of this arm, in the order wanted."""
        self._base: Array = np.ascontiguousarray(base_placement(base).homogeneous)
        self._chain = chain
        self._joint = np.array([c.joint for c in capsules], dtype=np.intp)
        self._local = np.array([[c.start, c.end] for c in capsules]).reshape(-1, 2, 3)

    def at(self, q: Array) -> Array:
        """[m, c, 2, 3] ends of the segments in frame O at the arm's poses q[m, n], rad."""
        compiled = kernels()
        if compiled is not None:
            out = np.empty((len(q), *self._local.shape))
            poses = np.ascontiguousarray(q)
            compiled.segment_ends(self._chain.joints, self._base, self._joint, self._local, poses, out)
            return out
        frames = list(self._chain.frames(q, self._base))
        ends = np.empty((len(self._joint), 2, 3, len(q)))
        for own, joint, local in zip(ends, self._joint, self._local, strict=True):
            axes, origin = frames[joint]
            np.add((local @ axes.reshape(3, -1)).reshape(2, 3, -1), origin, out=own)
        return ends.transpose(3, 0, 1, 2)


@dataclass(frozen=True, slots=True)
class CellArm:
    """An arm of a cell, with all that is on it."""

    segments: ArmSegments
    capsules: Indices
    """Which capsules of the cell they are."""
    axes: Indices


@lru_cache(maxsize=8)
def arms_of(shapes: Shapes) -> tuple[CellArm, ...]:
    """The arms that have capsules."""
    found = []
    for number, group in enumerate(shapes.cell.groups):
        own = [i for i, c in enumerate(shapes.capsules) if c.group == number]
        if own:
            segments = ArmSegments(group.base, shapes.chain(number), [shapes.capsules[i] for i in own])
            found.append(CellArm(segments, np.array(own), np.array(shapes.cell.axis_indices(group.name))))
    return tuple(found)


def reach(chain: Chain, capsule: LinkCapsule) -> Array:
    """[n] how far from each joint's axis a point of the capsule's segment can be in any pose, m (0: does not turn it).

    The way along the arm: the last link by where the segment lies, every link between by its length, the joint's own
    by what of it lies across the joint's axis.
    """
    ends = np.stack((capsule.start, capsule.end))
    lengths, across = np.linalg.norm(chain.ways, axis=1), np.hypot(chain.ways[:, 0], chain.ways[:, 1])
    reaches = np.zeros(len(chain))
    reaches[capsule.joint] = np.hypot(ends[:, 0], ends[:, 1]).max()
    way = float(np.linalg.norm(ends, axis=1).max())
    for joint in range(capsule.joint - 1, -1, -1):
        reaches[joint] = across[joint] + way
        way += float(lengths[joint])
    return reaches


def pair_reach(shapes: Shapes) -> Array:
    """[p, n] m/rad: turning axis i by x changes the distance of pair p by at most |x| times this.

    Within one arm only the joints between the two links count: the rest carries both alike.
    """
    cell = shapes.cell
    weights = np.zeros((len(shapes.pairs), len(cell.axes)))
    of_capsule = [reach(shapes.chain(c.group), c) for c in shapes.capsules]
    for p, (i, j) in enumerate(shapes.pairs):
        first = shapes.capsules[i]
        second = shapes.capsules[j] if j < len(shapes.capsules) else None
        if second is not None and second.group == first.group:
            later = second if second.joint > first.joint else first
            between = slice(min(first.joint, second.joint) + 1, later.joint + 1)
            base = later.axis - later.joint
            number = j if later is second else i
            weights[p, base + between.start : base + between.stop] = of_capsule[number][between]
            continue
        for number, capsule in ((i, first), (j, second)):
            if capsule is not None:
                base = capsule.axis - capsule.joint
                weights[p, base : base + len(of_capsule[number])] += of_capsule[number]
    return weights
