"""An arm: where its tool frame is."""

from collections.abc import Sequence

import numpy as np
import pinocchio
from numpy.typing import ArrayLike, NDArray

from axisync_robot.chain import Chain, base_placement, chain_of_rows
from axisync_robot.urdf_chain import chain_of_urdf
from axisync_schemas.cell import Group, Pose

Array = NDArray[np.float64]
Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def chain_of(group: Group) -> Chain | None:
    """The frames of a group's axes, or None where the cell file does not give them.

    Raises:
        ValueError: pinocchio cannot read its URDF file.
    """
    if group.urdf is not None:
        return chain_of_urdf(group.urdf, group.joint_names)
    rows = [axis.dh for axis in group.axes if axis.dh is not None]
    return chain_of_rows(rows) if len(rows) == len(group.axes) else None


class Arm:
    """A serial arm of n revolute joints, by pinocchio.

    Attributes: `base` [4, 4] in O, `chain`, and `tool` [4, 4] in the flange's frame.
    """

    def __init__(self, base: Pose, chain: Chain, tool: Pose | None = None) -> None:
        """The tool's frame is the flange's where none is given."""
        self.chain = chain
        self._model = pinocchio.Model()
        placement = base_placement(base)
        self.base: Array = placement.homogeneous
        fitted = base_placement(tool or Pose())
        self.tool: Array = fitted.homogeneous
        parent = 0
        for index, joint in enumerate(chain.joints):
            placement = placement * pinocchio.SE3(joint)
            parent = self._model.addJoint(parent, pinocchio.JointModelRZ(), placement, f"joint{index + 1}")
            placement = pinocchio.SE3.Identity()
        placement = pinocchio.SE3(chain.flange) * fitted
        frame = pinocchio.Frame("tool", parent, placement, pinocchio.FrameType.OP_FRAME)
        self._tool = self._model.addFrame(frame)
        self._data = self._model.createData()

    @classmethod
    def of(cls, group: Group) -> "Arm | None":
        """The arm of a group, or None where the cell file gives no chain for it."""
        chain = chain_of(group)
        return None if chain is None else cls(group.base, chain, group.tool)

    @property
    def joints(self) -> int:
        """n."""
        return int(self._model.nq)

    def placement(self, q: Sequence[float] | Array) -> Array:
        """[4, 4] pose of the tool frame in O at joint angles q[n], rad.

        Raises:
            ValueError: not n values.
        """
        pose: Array = self._frame(q).homogeneous
        return pose

    def _frame(self, q: Sequence[float] | Array) -> pinocchio.SE3:
        angles = np.asarray(q, dtype=np.float64)
        if angles.shape != (self.joints,):
            raise ValueError(f"{self.joints} joint angles are expected, not {angles.shape}")
        pinocchio.forwardKinematics(self._model, self._data, angles)
        return pinocchio.updateFramePlacement(self._model, self._data, self._tool)

    def placements(self, q: ArrayLike) -> Array:
        """[k, 4, 4] poses of the tool frame in O at joint angles q[k, n], rad, all at once.

        Raises:
            ValueError: not rows of n values.
        """
        angles = np.asarray(q, dtype=np.float64)
        if angles.ndim != 2 or angles.shape[1] != self.joints:
            raise ValueError(f"rows of {self.joints} joint angles are expected, not {angles.shape}")
        for axes, origin in self.chain.frames(angles, self.base):
            last = axes, origin
        columns = np.concatenate((last[0].reshape(3, -1), last[1].reshape(1, -1)))
        tool = ((self.chain.flange @ self.tool).T @ columns).reshape(4, 3, -1)
        poses = np.zeros((len(angles), 4, 4))
        poses[:, :3], poses[:, 3, 3] = tool.transpose(2, 1, 0), 1.0
        return poses

    def forward(self, q: Sequence[float] | Array) -> tuple[Position, Quaternion]:
        """Position (m) and quaternion (x, y, z, w; w >= 0) of the tool frame in O at joint angles q[n], rad.

        Raises:
            ValueError: not n values.
        """
        # Not by pinocchio.Quaternion(matrix): of each, 80 bytes are never freed.
        x, y, z, qx, qy, qz, qw = pinocchio.SE3ToXYZQUATtuple(self._frame(q))
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
        # Of a single joint pinocchio makes a vector.
        return pose, pinocchio.getFrameJacobian(self._model, self._data, self._tool, axes).reshape(6, -1)
