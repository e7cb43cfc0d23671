"""What the rows of a plan are: axes that begin at their setpoints, or lengths and angles of a path that begin at 0."""

import math
from typing import NamedTuple

from axisync_schemas.cell import Cell
from axisync_schemas.replies import MoveReply, State

SHOWN = {"deg": 180.0 / math.pi, "mm": 1e3}
"""Of rad and m."""
LENGTH = "length"


class Scalar(NamedTuple):
    """One row: its name, the unit it is shown in, and where it begins, SI; `axis`: it is one of the cell's."""

    name: str
    unit: str
    start: float
    axis: bool

    def shown(self, value: float) -> float:
        """An SI value (or rate) in the unit that is shown."""
        return value * SHOWN[self.unit]

    @property
    def label(self) -> str:
        """With its unit, where the rows of a table may have several."""
        return self.name if self.axis else f"{self.name}, {self.unit}"


def scalars_of(reply: MoveReply, state: State, cell: Cell) -> tuple[Scalar, ...]:
    """Of every row of T and U."""
    begins = {
        axis.name: value
        for group in cell.groups
        for axis, value in zip(group.axes, state.groups[group.name].setpoint, strict=True)
    }
    return tuple(_scalar(name, begins) for name in reply.scalars)


def _scalar(name: str, begins: dict[str, float]) -> Scalar:
    if name in begins:
        return Scalar(name, "deg", begins[name], True)
    return Scalar(name, "mm" if name.rpartition(".")[2] == LENGTH else "deg", 0.0, False)


def units(scalars: tuple[Scalar, ...]) -> tuple[str, ...]:
    """Those that occur, in order."""
    return tuple(dict.fromkeys(scalar.unit for scalar in scalars))
