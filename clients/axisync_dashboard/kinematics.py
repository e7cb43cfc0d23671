"""Where links are, from the cell file's DH rows: only what drawing needs. Metres and radians, in the cell's frame O.

Standard DH (Denavit and Hartenberg, 1955): A_i = Rz(q_i + theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_schemas.cell import Axis, Cell, DenavitHartenberg, Group, Pose

Array = NDArray[np.float64]
Segment = tuple[tuple[float, float, float], tuple[float, float, float], float]
"""Start, end and radius of a capsule, m."""

BONE = 0.012
"""m: radius of a link that has no shape in the cell file; it is drawn all the same."""


@dataclass(frozen=True)
class Link:
    """What one axis turns about its z.

    Attributes:
        fixed: [4, 4] from the frame that turns with the axis before (or from O) to this axis's at position 0.
        capsules: in the frame that turns with the axis.
    """

    axis: str
    fixed: Array
    capsules: tuple[Segment, ...]


@dataclass(frozen=True)
class Arm:
    """A group's chain; `tool` [4, 4] leads from the last axis's frame to the tool's."""

    group: str
    links: tuple[Link, ...]
    tool: Array

    def tool_poses(self, positions: ArrayLike) -> Array:
        """[m, 4, 4] of the tool for positions [m, n] in rad."""
        angles = np.atleast_2d(np.asarray(positions, dtype=np.float64))
        frames = np.broadcast_to(np.eye(4), (len(angles), 4, 4))
        for link, angle in zip(self.links, angles.T, strict=True):
            frames = frames @ link.fixed @ turn_z(angle)
        tools: Array = frames @ self.tool
        return tools


def arms_of(cell: Cell) -> tuple[Arm | None, ...]:
    """An arm for each group; None where its axes have no DH rows."""
    return tuple(_arm(group) for group in cell.groups)


def _arm(group: Group) -> Arm | None:
    if any(axis.dh is None for axis in group.axes):
        return None
    links = []
    to_axis = matrix_of(group.base)
    for axis in group.axes:
        assert axis.dh is not None
        links.append(Link(axis.name, to_axis @ turn_z(np.array(axis.dh.theta)), _capsules(axis, axis.dh)))
        to_axis = _offsets(axis.dh)
    return Arm(group.name, tuple(links), to_axis @ matrix_of(group.tool))


def _capsules(axis: Axis, dh: DenavitHartenberg) -> tuple[Segment, ...]:
    """As the cell file has it: its own capsules, or along d, then a."""
    if axis.capsules:
        return tuple((capsule.start, capsule.end, capsule.radius) for capsule in axis.capsules)
    corner = (0.0, 0.0, dh.d)
    ways = (((0.0, 0.0, 0.0), corner), (corner, (dh.a, 0.0, dh.d)))
    return tuple((start, end, axis.radius or BONE) for start, end in ways if start != end)


def _offsets(dh: DenavitHartenberg) -> Array:
    """Tz(d) Tx(a) Rx(alpha)."""
    moved = turn_x(dh.alpha)
    moved[:3, 3] = dh.a, 0.0, dh.d
    return moved


def matrix_of(pose: Pose) -> Array:
    """[4, 4] of a pose: Rz(yaw) Ry(pitch) Rx(roll) and its position."""
    roll, pitch, yaw = pose.rpy
    about_y = np.eye(4)
    about_y[0, 0] = about_y[2, 2] = np.cos(pitch)
    about_y[0, 2], about_y[2, 0] = np.sin(pitch), -np.sin(pitch)
    matrix: Array = turn_z(np.array(yaw)) @ about_y @ turn_x(roll)
    matrix[:3, 3] = pose.position
    return matrix


def turn_z(angle: Array) -> Array:
    """[..., 4, 4] of rotations about z by angles [...] in rad."""
    turned = np.zeros((*angle.shape, 4, 4))
    turned[..., 0, 0] = turned[..., 1, 1] = np.cos(angle)
    turned[..., 1, 0] = np.sin(angle)
    turned[..., 0, 1] = -np.sin(angle)
    turned[..., 2, 2] = turned[..., 3, 3] = 1.0
    return turned


def turn_x(angle: float) -> Array:
    """[4, 4] of a rotation about x."""
    turned = np.eye(4)
    turned[1, 1] = turned[2, 2] = np.cos(angle)
    turned[2, 1], turned[1, 2] = np.sin(angle), -np.sin(angle)
    return turned
