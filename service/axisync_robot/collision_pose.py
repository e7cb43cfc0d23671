"""The nearest pair at one pose, by pinocchio and coal."""

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisync_robot.chain import Chain, base_placement
from axisync_robot.collision_shapes import LinkCapsule, Shapes
from axisync_schemas.cell import Group

Array = NDArray[np.float64]


class PoseChecker:
    """All shapes of the cell in frame O as one pinocchio model."""

    def __init__(self, shapes: Shapes) -> None:
        """Axes of groups that have no arm model are left out: nothing of theirs has a shape."""
        self._model = pinocchio.Model()
        self._axes: list[int] = []
        joints: dict[int, int] = {}
        first = 0
        for group, chain in zip(shapes.cell.groups, shapes.chains, strict=True):
            if chain is not None:
                self._add_arm(group, chain, first, joints)
            first += len(group.axes)
        self._geometry = pinocchio.GeometryModel()
        for number, capsule in enumerate(shapes.capsules):
            shape = coal.Capsule(capsule.radius, float(np.linalg.norm(capsule.end - capsule.start)))
            self._add_shape(f"{number} {capsule.words}", joints[capsule.axis], _along(capsule), shape)
        for box in shapes.boxes:
            self._add_shape(box.name, 0, pinocchio.SE3(box.rotation, box.position), coal.Box(*(2.0 * box.half)))
        for i, j in shapes.pairs.tolist():
            self._geometry.addCollisionPair(pinocchio.CollisionPair(i, j))
        self._data = self._model.createData()
        self._geometry_data = self._geometry.createData()

    def _add_arm(self, group: Group, chain: Chain, first: int, joints: dict[int, int]) -> None:
        placement = base_placement(group.base)
        parent = 0
        for offset, joint in enumerate(chain.joints):
            name = group.axes[offset].name
            parent = self._model.addJoint(parent, pinocchio.JointModelRZ(), placement * pinocchio.SE3(joint), name)
            placement = pinocchio.SE3.Identity()
            joints[first + offset] = parent
            self._axes.append(first + offset)

    def _add_shape(self, name: str, parent: int, placement: pinocchio.SE3, shape: coal.ShapeBase) -> None:
        self._geometry.addGeometryObject(pinocchio.GeometryObject(name, parent, placement, shape))

    def nearest(self, q: Sequence[float] | Array, skip: Sequence[int] = ()) -> tuple[float, int]:
        """Distance (m, negative where shapes overlap) and number of the nearest pair at q[n], pairs `skip` left out."""
        for pair in skip:
            self._geometry_data.deactivateCollisionPair(pair)
        angles = np.asarray(q, dtype=np.float64)[self._axes]
        found = pinocchio.computeDistances(self._model, self._data, self._geometry, self._geometry_data, angles)
        for pair in skip:
            self._geometry_data.activateCollisionPair(pair)
        return float(self._geometry_data.distanceResults[found].min_distance), int(found)


def _along(capsule: LinkCapsule) -> pinocchio.SE3:
    """Middle of the segment, z along it, as coal has its capsules."""
    middle, way = (capsule.start + capsule.end) / 2.0, capsule.end - capsule.start
    if not way.any():
        return pinocchio.SE3(np.eye(3), middle)
    turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), way / np.linalg.norm(way))
    return pinocchio.SE3(turn.matrix(), middle)
