"""What can collide: capsules on links, boxes that stand still, and the pairs of them that are watched."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from axisync_robot.arm import chain_of
from axisync_robot.chain import Chain, base_placement
from axisync_robot.urdf_chain import Segment, segments_of_urdf
from axisync_schemas.cell import Axis, Box, Cell, Group

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


@dataclass(frozen=True, eq=False)
class Shapes:
    """All shapes of a cell. A shape's number is its place in `capsules`, then in `boxes`."""

    cell: Cell
    chains: tuple[Chain | None, ...]
    """Of each group; a group whose axes have shapes has one (the cell file's check makes sure of it)."""
    capsules: tuple[LinkCapsule, ...]
    boxes: tuple[FixedBox, ...]

    @classmethod
    def of(cls, cell: Cell) -> "Shapes":
        """Shapes as the cell file gives them, or from its radii, or from its URDF files.

        Raises:
            ValueError: pinocchio cannot read a URDF file.
        """
        chains = tuple(chain_of(group) for group in cell.groups)
        boxes = tuple(_box(box) for box in cell.geometry.boxes)
        return cls(cell, chains, tuple(_capsules(cell, chains)), boxes)

    def chain(self, group: int) -> Chain:
        """Of a group whose axes have shapes."""
        chain = self.chains[group]
        assert chain is not None
        return chain

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of each shape in the cell file: its axis's or its box's."""
        return tuple(c.name for c in self.capsules) + tuple(b.name for b in self.boxes)

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Each shape as people read it."""
        return tuple(c.words for c in self.capsules) + tuple(b.name for b in self.boxes)

    @cached_property
    def radii(self) -> Array:
        """[c + b] m, of each shape; a box has none."""
        return np.array([c.radius for c in self.capsules] + [0.0] * len(self.boxes))

    @cached_property
    def box_arrays(self) -> tuple[Array, Array, Array]:
        """Of all boxes: rotations [b, 3, 3], positions and halves [b, 3]."""
        rotation, position, half = (
            np.array([getattr(b, name) for b in self.boxes]) for name in ("rotation", "position", "half")
        )
        return rotation.reshape(-1, 3, 3), position.reshape(-1, 3), half.reshape(-1, 3)

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


def _capsules(cell: Cell, chains: Sequence[Chain | None]) -> Iterator[LinkCapsule]:
    number = 0
    for g, (group, chain) in enumerate(zip(cell.groups, chains, strict=True)):
        for joint, axis in enumerate(group.axes):
            words = f"{group.name} link {joint + 1}"
            for start, end, radius in () if chain is None else _segments(group, chain, joint):
                yield LinkCapsule(axis.name, words, g, joint, number, start, end, radius)
            number += 1


def _segments(group: Group, chain: Chain, joint: int) -> Iterator[Segment]:
    """Start, end and radius in the joint's frame: what the cell file gives, its radius makes, or its URDF file has."""
    axis = group.axes[joint]
    if not axis.capsules and axis.radius is not None:
        for start, end in _way(axis, chain.ways[joint]):
            if np.any(start != end):
                yield start, end, axis.radius
        return
    segments: Iterable[Segment] = ((np.array(c.start), np.array(c.end), c.radius) for c in axis.capsules)
    if not axis.capsules and group.urdf is not None:
        segments = segments_of_urdf(group.urdf, group.joint_names[joint])
    for start, end, radius in segments:
        yield chain.links[joint] @ start, chain.links[joint] @ end, radius


def _way(axis: Axis, way: Array) -> list[tuple[Array, Array]]:
    """From the joint's origin to the next one's: along d, then a; straight where there is no DH row."""
    corner = np.zeros(3) if axis.dh is None else np.array([0.0, 0.0, axis.dh.d])
    return [(np.zeros(3), corner), (corner, way)]


def _box(box: Box) -> FixedBox:
    pose = base_placement(box.pose)
    return FixedBox(box.name, np.array(pose.rotation), np.array(pose.translation), np.array(box.size) / 2.0)
