"""A serial arm as a chain of frames, however it was described: each joint turns about z of its own frame."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisync_schemas.cell import DenavitHartenberg, Pose

Array = NDArray[np.float64]


def _exact(angle: float) -> tuple[float, float]:
    """Cosine and sine, exact at multiples of a right angle, so that no 6e-17 stands where the design has 0."""
    quarters = angle / (math.pi / 2.0)
    nearest = round(quarters)
    if abs(quarters - nearest) < 1e-15:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[nearest % 4]
    return math.cos(angle), math.sin(angle)


def rotation_x(angle: float) -> Array:
    """[3, 3]."""
    c, s = _exact(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> Array:
    """[3, 3]."""
    c, s = _exact(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> Array:
    """[3, 3]."""
    c, s = _exact(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def base_placement(base: Pose) -> pinocchio.SE3:
    """A pose of the cell file: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = base.rpy
    return pinocchio.SE3(rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll), np.array(base.position))


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Frames at joint angles zero.

    Attributes:
        joints: [n, 4, 4] each joint's frame in the one before it, the first in the arm's base.
        flange: [4, 4] in the last joint's frame.
        links: [n, 3, 3] how the frame in which a link's shapes are given is turned from its joint's.
    """

    joints: Array
    flange: Array
    links: Array

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def ways(self) -> Array:
        """[n, 3] from each joint's origin to the next one's, the last to the flange's, in the joint's frame, m."""
        return np.concatenate((self.joints[1:, :3, 3], self.flange[None, :3, 3]))

    def frames(self, q: Array, base: Array) -> Iterator[tuple[Array, Array]]:
        """Joint by joint its frame at q [m, n], rad, from base [4, 4]: the axes x, y, z [3, 3, m], the origin [3, m].

        Of an axis the three coordinates, then poses last, as numpy is quickest. Lengths in m.
        """
        cosines, sines = np.cos(q.T), np.sin(q.T)
        axes, origin = np.repeat(base[:3, :3].T[..., None], len(q), axis=2), base[:3, 3, None]
        for placement, c, s in zip(self.joints, cosines, sines, strict=True):
            before = axes.reshape(3, -1)
            origin = origin + (placement[:3, 3] @ before).reshape(3, -1)
            x, y, z = (placement[:3, :3].T @ before).reshape(3, 3, -1)
            axes = np.empty((3, 3, len(q)))
            axes[2] = z
            np.add(c * x, s * y, out=axes[0])
            np.subtract(c * y, s * x, out=axes[1])
            yield axes, origin


def chain_of_rows(rows: Sequence[DenavitHartenberg]) -> Chain:
    """Joint i turns by q[i] + theta_i about z of the frame before it; row i then leads to the next frame."""
    placement = pinocchio.SE3.Identity()
    joints = []
    for row in rows:
        joints.append((placement * pinocchio.SE3(rotation_z(row.theta), np.zeros(3))).homogeneous)
        # Trans_z(d) Trans_x(a) Rot_x(alpha)
        placement = pinocchio.SE3(rotation_x(row.alpha), np.array([row.a, 0.0, row.d]))
    return Chain(np.array(joints), placement.homogeneous, np.tile(np.eye(3), (len(joints), 1, 1)))
