"""What can collide: capsules on links, boxes that stand still, and the pairs of them that are watched."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import base_placement
from axisync_schemas.cell import Axis, Box, Capsule, Cell, DenavitHartenberg

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class LinkCapsule:
    """A capsule in the frame that turns with `axis`; several may wrap one link."""

    name: str
    """Of the axis, as the cell file names it."""
    words: str
    """As people read it: "kingkong link 3"."""
    group: int
    joint: int
    """Within the group, from 0."""
    axis: int
    """Within the cell."""
    start: Array
    end: Array
    radius: float


@dataclass(frozen=True, slots=True)
class FixedBox:
    """A box in frame O."""

    name: str
    rotation: Array
    """[3, 3]."""
    position: Array
    """[3], of its middle."""
    half: Array
    """[3], half its edges."""


@dataclass(frozen=True)
class Shapes:
    """All shapes of a cell. A shape's number is its place in `capsules`, then in `boxes`."""

    cell: Cell
    capsules: tuple[LinkCapsule, ...]
    boxes: tuple[FixedBox, ...]

    @classmethod
    def of(cls, cell: Cell) -> "Shapes":
        """Shapes as the cell file gives them, or from its DH rows and radii."""
        return cls(cell, tuple(_capsules(cell)), tuple(_box(box) for box in cell.geometry.boxes))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of each shape in the cell file: its axis's or its box's."""
        return tuple(c.name for c in self.capsules) + tuple(b.name for b in self.boxes)

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Each shape as people read it."""
        return tuple(c.words for c in self.capsules) + tuple(b.name for b in self.boxes)

    @cached_property
    def pairs(self) -> Indices:
        """[p, 2] numbers of the shapes watched, the first always a capsule.

        Left out: shapes of one link and of neighbours on one arm (their joint holds them together), boxes among
        themselves, and what the cell file allows.
        """
        allowed = {frozenset(pair) for pair in self.cell.geometry.allowed}
        kept = [
            (i, j)
            for i, j in combinations(range(len(self.names)), 2)
            if i < len(self.capsules)
            and not self._neighbours(i, j)
            and frozenset((self.names[i], self.names[j])) not in allowed
        ]
        return np.array(kept, dtype=np.intp).reshape(-1, 2)

    def _neighbours(self, i: int, j: int) -> bool:
        if j >= len(self.capsules):
            return False
        a, b = self.capsules[i], self.capsules[j]
        return a.group == b.group and abs(a.joint - b.joint) <= 1

    def named(self, pairs: Iterable[tuple[str, str]]) -> NDArray[np.bool_]:
        """[p] which of `self.pairs` these pairs of axis and box names cover."""
        wanted = {frozenset(pair) for pair in pairs}
        return np.array([frozenset((self.names[i], self.names[j])) in wanted for i, j in self.pairs], dtype=np.bool_)


def _capsules(cell: Cell) -> Iterator[LinkCapsule]:
    number = 0
    for g, group in enumerate(cell.groups):
        for joint, axis in enumerate(group.axes):
            for shape in axis.capsules or tuple(_from_dh(axis)):
                yield LinkCapsule(
                    axis.name, f"{group.name} link {joint + 1}", g, joint, number,
                    np.array(shape.start), np.array(shape.end), shape.radius,
                )  # fmt: skip
            number += 1


def _from_dh(axis: Axis) -> Iterator[Capsule]:
    """One capsule along d, one along a, where they are not zero."""
    if axis.radius is None or axis.dh is None:
        return
    origin, corner, tip = (0.0, 0.0, 0.0), (0.0, 0.0, axis.dh.d), (axis.dh.a, 0.0, axis.dh.d)
    for start, end in ((origin, corner), (corner, tip)):
        if start != end:
            yield Capsule(start=start, end=end, radius=axis.radius)


def _box(box: Box) -> FixedBox:
    pose = base_placement(box.pose)
    return FixedBox(box.name, np.array(pose.rotation), np.array(pose.translation), np.array(box.size) / 2.0)


def rows_of(cell: Cell, group: int) -> list[DenavitHartenberg]:
    """DH rows of a group whose axes have shapes (the cell file's check makes sure of them)."""
    return [axis.dh for axis in cell.groups[group].axes if axis.dh is not None]
