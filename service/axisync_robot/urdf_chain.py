"""An arm from a URDF file: its chain by pinocchio's reader, its links' shapes as capsules."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio
from numpy.typing import NDArray

from axisync_robot.chain import Chain, base_placement, rotation_x
from axisync_robot.poses import inverse_pose
from axisync_schemas.cell import Pose
from axisync_schemas.urdf import SOLID, Urdf, UrdfShape

Array = NDArray[np.float64]
Segment = tuple[Array, Array, float]
"""Start, end [3] and radius of a capsule, m."""

_SNAP = 1e-8
"""Rotations this near to right angles are right angles: files say 1.570796327, and closed forms need exact ones."""


def chain_of_urdf(urdf: Urdf, joints: Sequence[str]) -> Chain:
    """The chain from base to tip; fixed joints are merged, every axis is turned onto z.

    Raises:
        ValueError: pinocchio cannot read it.
    """
    model = _model(urdf)
    axes = _turns_onto_axes(model, joints)
    base, tip = (_link_placement(model, link) for link in (urdf.root, urdf.tip))
    placements = [model.jointPlacements[model.getJointId(name)].homogeneous for name in joints]
    placements[0] = inverse_pose(base) @ placements[0]
    before, after = (np.eye(4), *axes), (*axes, np.eye(4))
    ways = zip(before, (*placements, tip), after, strict=True)
    *frames, flange = (_snapped(back.T @ way @ turn) for back, way, turn in ways)
    return Chain(np.array(frames), flange, np.array([axis[:3, :3].T for axis in axes]))


def segments_of_urdf(urdf: Urdf, joint: str) -> Iterator[Segment]:
    """Around the spheres, cylinders and boxes of every link that this joint moves, in its child link's frame."""
    model = _model(urdf)
    for link, shapes in urdf.tree.links.items():
        bearer = urdf.tree.bearer(link)
        if bearer is not None and bearer.name == joint:
            placement = _link_placement(model, link)
            yield from (_segment(placement, shape) for shape in shapes if shape.kind in SOLID)


def _model(urdf: Urdf) -> pinocchio.Model:
    try:
        return pinocchio.buildModelFromXML(urdf.text)
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"{urdf.file}: {error}") from None


def _turns_onto_axes(model: pinocchio.Model, joints: Sequence[str]) -> list[Array]:
    """[4, 4] for each joint: the turn that takes z onto its axis. The axis is what a rate of 1 turns about."""
    data = model.createData()
    pinocchio.computeJointJacobians(model, data, pinocchio.neutral(model))
    turns = []
    for name in joints:
        number = model.getJointId(name)
        slope = pinocchio.getJointJacobian(model, data, number, pinocchio.ReferenceFrame.LOCAL).reshape(6, -1)
        turn = np.eye(4)
        turn[:3, :3] = _onto(slope[3:, model.idx_vs[number]])
        turns.append(turn)
    return turns


def _onto(axis: Array) -> Array:
    """[3, 3]: takes z onto the axis, which has unit length."""
    if axis[2] < -1.0 + _SNAP:
        return rotation_x(math.pi)
    turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis / np.linalg.norm(axis)).matrix()
    rotation: Array = np.where(np.abs(turn - np.rint(turn)) < 1e-15, np.rint(turn), turn)
    return rotation


def _snapped(placement: Array) -> Array:
    snapped = placement.copy()
    nearest = np.rint(placement[:3, :3])
    if np.abs(placement[:3, :3] - nearest).max() < _SNAP:
        snapped[:3, :3] = nearest
    return snapped


def _link_placement(model: pinocchio.Model, link: str) -> Array:
    """[4, 4] of a link in the frame of the joint that moves it."""
    placement: Array = model.frames[model.getFrameId(link, pinocchio.FrameType.BODY)].placement.homogeneous
    return placement


def _segment(link: Array, shape: UrdfShape) -> Segment:
    """What encloses the shape: a cylinder's axis or a box's longest one is the segment."""
    x, y, z = shape.xyz
    roll, pitch, yaw = (math.degrees(angle) for angle in shape.rpy)
    placed = link @ base_placement(Pose(position=(x, y, z), rpy=(roll, pitch, yaw))).homogeneous
    way, radius = _half_way(shape)
    middle, turned = placed[:3, 3], placed[:3, :3] @ way
    return middle - turned, middle + turned, radius


def _half_way(shape: UrdfShape) -> tuple[Array, float]:
    """[3] from the middle to the segment's end, and the radius."""
    way = np.zeros(3)
    if shape.kind == "sphere":
        return way, shape.size[0]
    if shape.kind == "cylinder":
        way[2] = shape.size[1] / 2.0
        return way, shape.size[0]
    half = np.array(shape.size) / 2.0
    longest = int(half.argmax())
    way[longest] = half[longest]
    return way, float(np.linalg.norm(np.delete(half, longest)))
