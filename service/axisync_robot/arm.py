"""An arm from its Denavit-Hartenberg rows: where its tool frame is."""

import math
from collections.abc import Sequence

import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisync_schemas.cell import DenavitHartenberg, Group, Pose

Array = NDArray[np.float64]
Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


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
    """Pose of the arm's base in the cell's frame O: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = base.rpy
    return pinocchio.SE3(rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll), np.array(base.position))


def link_placement(row: DenavitHartenberg) -> pinocchio.SE3:
    """Trans_z(d) Trans_x(a) Rot_x(alpha): what follows a joint's rotation, d along z, a along x, alpha about x."""
    return pinocchio.SE3(rotation_x(row.alpha), np.array([row.a, 0.0, row.d]))


class Arm:
    """A serial arm of n revolute joints, by pinocchio. `rows` as given; `base` [4, 4] is its base in O."""

    def __init__(self, base: Pose, rows: Sequence[DenavitHartenberg]) -> None:
        """Joint i turns by q[i] + theta_i about z of the frame before it; row i then leads to the next frame."""
        self.rows = tuple(rows)
        self._model = pinocchio.Model()
        placement = base_placement(base)
        self.base: Array = placement.homogeneous
        parent = 0
        for index, row in enumerate(rows):
            placement = placement * pinocchio.SE3(rotation_z(row.theta), np.zeros(3))
            parent = self._model.addJoint(parent, pinocchio.JointModelRZ(), placement, f"joint{index + 1}")
            placement = link_placement(row)
        frame = pinocchio.Frame("tool", parent, placement, pinocchio.FrameType.OP_FRAME)
        self._tool = self._model.addFrame(frame)
        self._data = self._model.createData()

    @classmethod
    def of(cls, group: Group) -> "Arm | None":
        """The arm of a group, or None where an axis has no row."""
        rows = [axis.dh for axis in group.axes if axis.dh is not None]
        return cls(group.base, rows) if len(rows) == len(group.axes) else None

    @property
    def joints(self) -> int:
        """n."""
        return int(self._model.nq)

    def placement(self, q: Sequence[float] | Array) -> Array:
        """[4, 4] pose of the tool frame in O at joint angles q[n], rad.

        Raises:
            ValueError: not n values.
        """
        angles = np.asarray(q, dtype=np.float64)
        if angles.shape != (self.joints,):
            raise ValueError(f"{self.joints} joint angles are expected, not {angles.shape}")
        pinocchio.forwardKinematics(self._model, self._data, angles)
        pose: Array = pinocchio.updateFramePlacement(self._model, self._data, self._tool).homogeneous
        return pose

    def forward(self, q: Sequence[float] | Array) -> tuple[Position, Quaternion]:
        """Position (m) and quaternion (x, y, z, w; w >= 0) of the tool frame in O at joint angles q[n], rad.

        Raises:
            ValueError: not n values.
        """
        pose = self.placement(q)
        x, y, z = pose[:3, 3].tolist()
        qx, qy, qz, qw = pinocchio.Quaternion(pose[:3, :3]).coeffs().tolist()
        sign = -1.0 if qw < 0.0 else 1.0
        return (x, y, z), (sign * qx, sign * qy, sign * qz, sign * qw)

    def jacobian(self, q: Sequence[float] | Array) -> tuple[Array, Array]:
        """Pose [4, 4] of the tool frame in O, and its Jacobian [6, n]: m/rad, then rad/rad, along the axes of O.

        Raises:
            ValueError: not n values.
        """
        pose = self.placement(q)
        pinocchio.computeJointJacobians(self._model, self._data)
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return pose, pinocchio.getFrameJacobian(self._model, self._data, self._tool, axes)
