"""Everything about a cell that planning needs and no move changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import Arm
from axisync_robot.collision import CollisionModel
from axisync_robot.inverse import Inverse, inverse_of
from axisync_schemas.cell import Axis, Cell, Group
from axisync_schemas.errors import ErrorCode, Refusal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Member:
    """An elementary group and its arm; `columns` are its axes' places among those of the group that is planned."""

    group: Group
    arm: Arm | None
    columns: slice

    def kinematics(self) -> Arm:
        """
        Raises:
            Refusal: INVALID_REQUEST, the group has no arm model.
        """
        if self.arm is None:
            message = f"{self.group.name} has no arm model in the cell file: only joint moves to joint values"
            raise Refusal(ErrorCode.INVALID_REQUEST, message, group=self.group.name)
        return self.arm

    def inverse(self, start: Array) -> Inverse:
        """The solver within soft limits; a start outside of them may be left, not gone further from."""
        low, high = np.array([axis.soft_limits for axis in self.group.axes]).T
        return inverse_of(self.kinematics(), np.minimum(low, start), np.maximum(high, start))


class Models:
    """The arms and shapes of a cell; made once."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.collision = CollisionModel(cell)
        self._arms = [Arm.of(group) for group in cell.groups]

    def axes(self, group: str) -> tuple[Axis, ...]:
        """Of a group or compound, in the order of its plans' columns."""
        return tuple(self.cell.axes[i] for i in self.cell.axis_indices(group))

    def members(self, group: str) -> tuple[Member, ...]:
        """Elementary groups of a group or compound, in the order of its plans' columns."""
        found, begin = [], 0
        for index in self.cell.members(group):
            elementary = self.cell.groups[index]
            end = begin + len(elementary.axes)
            found.append(Member(elementary, self._arms[index], slice(begin, end)))
            begin = end
        return tuple(found)
