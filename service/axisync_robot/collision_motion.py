"""Where the capsules of an arm are at many poses at once, and how far a joint's turn can carry them at most."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import base_placement, rotation_x
from axisync_robot.collision_shapes import LinkCapsule, Shapes, rows_of
from axisync_schemas.cell import DenavitHartenberg, Pose

Array = NDArray[np.float64]


class ArmSegments:
    """The segments of one arm's capsules, many poses at once: fewer and larger numpy calls than pose by pose."""

    def __init__(self, base: Pose, rows: Sequence[DenavitHartenberg], capsules: Sequence[LinkCapsule]) -> None:
        """Capsules of this arm, in the order wanted."""
        placement = base_placement(base)
        self._turn, self._origin = np.array(placement.rotation), np.array(placement.translation)
        self._theta = np.array([row.theta for row in rows])
        self._way = np.array([[row.a, 0.0, row.d] for row in rows])
        self._tilt = np.array([rotation_x(row.alpha) for row in rows])
        self._joint = np.array([c.joint for c in capsules], dtype=np.intp)
        self._local = np.array([[c.start, c.end] for c in capsules]).reshape(-1, 2, 3)

    def at(self, q: Array) -> Array:
        """[m, c, 2, 3] ends of the segments in frame O at the arm's poses q[m, n], rad."""
        turned = _about_z(q + self._theta)
        turns, origins = np.empty_like(turned), np.empty(turned.shape[:3])
        turn, origin = self._turn, self._origin
        for joint in range(q.shape[1]):
            turns[:, joint] = turn @ turned[:, joint]
            origins[:, joint] = origin
            origin = origin + turns[:, joint] @ self._way[joint]
            turn = turns[:, joint] @ self._tilt[joint]
        local = np.einsum("mcij,ckj->mcki", turns[:, self._joint], self._local)
        ends: Array = origins[:, self._joint, None, :] + local
        return ends


def _about_z(angles: Array) -> Array:
    """[m, n, 3, 3] of angles[m, n]."""
    turns = np.zeros((*angles.shape, 3, 3))
    turns[..., 0, 0] = turns[..., 1, 1] = np.cos(angles)
    turns[..., 1, 0] = np.sin(angles)
    turns[..., 0, 1] = -turns[..., 1, 0]
    turns[..., 2, 2] = 1.0
    return turns


def reach(rows: Sequence[DenavitHartenberg], capsule: LinkCapsule) -> Array:
    """[n] how far from each joint's axis a point of the capsule's segment can be in any pose, m (0: does not turn it).

    The way along the arm: the last link by where the segment lies, every link between by its length, the joint's own
    by `a` alone, since d runs along the axis.
    """
    ends = np.stack((capsule.start, capsule.end))
    reaches = np.zeros(len(rows))
    reaches[capsule.joint] = np.hypot(ends[:, 0], ends[:, 1]).max()
    way = float(np.linalg.norm(ends, axis=1).max())
    for joint in range(capsule.joint - 1, -1, -1):
        reaches[joint] = abs(rows[joint].a) + way
        way += math.hypot(rows[joint].a, rows[joint].d)
    return reaches


def pair_reach(shapes: Shapes) -> Array:
    """[p, n] m/rad: turning axis i by x changes the distance of pair p by at most |x| times this.

    Within one arm only the joints between the two links count: the rest carries both alike.
    """
    cell = shapes.cell
    weights = np.zeros((len(shapes.pairs), len(cell.axes)))
    of_capsule = [reach(rows_of(cell, c.group), c) for c in shapes.capsules]
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
