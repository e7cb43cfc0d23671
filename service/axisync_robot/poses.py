"""Orientations and poses in every form that a command may use, vectorised over any leading dimensions.

Quaternions are (x, y, z, w). Euler angles are the paper's: intrinsic ZYZ, R = Rz(a) Ry(b) Rz(g). Poses are [..., 4, 4].
"""

from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_schemas.moves import UNIT_TOLERANCE

Array = NDArray[np.float64]

ZYZ_SINGULAR = 1e-12
"""Below this sine of beta only alpha + gamma (at 0) or alpha - gamma (at 180 deg) is defined."""


class Frame(StrEnum):
    """What a pose is given in."""

    BASE = "base"
    """The frame of the arm's own base."""
    BODY = "body"
    """O, the frame of the cell."""


class NotUnitQuaternion(ValueError):
    """A quaternion that is not of unit length, or not finite.

    Attributes: `value` (its length), `bound` (how far from 1 the length may be), `index` (which one, of several).
    """

    def __init__(self, value: float, bound: float, index: int = 0) -> None:
        self.value = value
        self.bound = bound
        self.index = index
        super().__init__(value, bound, index)

    def __str__(self) -> str:
        return f"quaternion {self.index} has length {self.value:.9g}: must be 1 within {self.bound:g}"


def unit_quaternion(quaternion: ArrayLike) -> Array:
    """The same rotation at exactly unit length, [..., 4].

    Raises:
        NotUnitQuaternion: the length is off by more than 1e-3, or not a number.
    """
    q = np.asarray(quaternion, dtype=np.float64)
    length = np.linalg.norm(q, axis=-1)
    wrong = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_TOLERANCE))
    if wrong.size:
        index = int(wrong[0])
        raise NotUnitQuaternion(float(np.ravel(length)[index]), UNIT_TOLERANCE, index)
    unit: Array = q / length[..., None]
    return unit


def rotation_of_quaternion(quaternion: ArrayLike) -> Array:
    """[..., 3, 3].

    Raises:
        NotUnitQuaternion: as `unit_quaternion`.
    """
    x, y, z, w = np.moveaxis(unit_quaternion(quaternion), -1, 0)
    return _matrix(
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def quaternion_of_rotation(rotation: ArrayLike) -> Array:
    """[..., 4] with w >= 0, from the largest of the four squares, so that no digits cancel (Shepperd)."""
    r = np.asarray(rotation, dtype=np.float64)
    xx, yy, zz = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    squares = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz], axis=-1)
    xy, xz, yz = r[..., 0, 1] + r[..., 1, 0], r[..., 0, 2] + r[..., 2, 0], r[..., 1, 2] + r[..., 2, 1]
    xw, yw, zw = r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]
    rows = np.stack(
        [
            np.stack([squares[..., 0], xy, xz, xw], axis=-1),
            np.stack([xy, squares[..., 1], yz, yw], axis=-1),
            np.stack([xz, yz, squares[..., 2], zw], axis=-1),
            np.stack([xw, yw, zw, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(squares, axis=-1)[..., None, None]
    q = np.take_along_axis(rows, largest, axis=-2)[..., 0, :]
    unit: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(unit[..., 3:] < 0.0, -unit, unit)


def rotation_of_zyz(angles: ArrayLike) -> Array:
    """[..., 3, 3] of (alpha, beta, gamma), rad: R = Rz(alpha) Ry(beta) Rz(gamma)."""
    a, b, g = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    ca, sa, cb, sb, cg, sg = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(g), np.sin(g)
    return _matrix(
        (ca * cb * cg - sa * sg, -ca * cb * sg - sa * cg, ca * sb),
        (sa * cb * cg + ca * sg, -sa * cb * sg + ca * cg, sa * sb),
        (-sb * cg, sb * sg, cb),
    )


def zyz_of_rotation(rotation: ArrayLike) -> Array:
    """(alpha, beta, gamma) [..., 3], rad, beta in [0, pi], the others in (-pi, pi].

    Singular at beta = 0 and 180 deg, where only alpha + gamma or alpha - gamma is defined: there gamma is 0. Do not
    interpolate these angles near it; use the rotation vector.
    """
    r = np.asarray(rotation, dtype=np.float64)
    sine = np.hypot(r[..., 0, 2], r[..., 1, 2])
    beta = np.arctan2(sine, r[..., 2, 2])
    singular = sine < ZYZ_SINGULAR
    flip = np.where(r[..., 2, 2] < 0.0, -1.0, 1.0)
    # With gamma = 0: R = Rz(alpha) at beta = 0, and R = Rz(alpha) diag(-1, 1, -1) at 180 deg.
    held = np.arctan2(flip * r[..., 1, 0], flip * r[..., 0, 0])
    alpha = np.where(singular, held, np.arctan2(r[..., 1, 2], r[..., 0, 2]))
    gamma = np.where(singular, 0.0, np.arctan2(r[..., 2, 1], -r[..., 2, 0]))
    return np.stack([alpha, beta, gamma], axis=-1)


def rotation_of_vector(vector: ArrayLike) -> Array:
    """[..., 3, 3]: a turn by |vector| rad about its direction (Rodrigues)."""
    v = np.asarray(vector, dtype=np.float64)
    half = np.linalg.norm(v, axis=-1, keepdims=True) / 2.0
    # sin(h) / h, its limit 1 included; numpy's sinc is of pi x.
    imaginary = v / 2.0 * np.sinc(half / np.pi)
    return rotation_of_quaternion(np.concatenate([imaginary, np.cos(half)], axis=-1))


def vector_of_rotation(rotation: ArrayLike) -> Array:
    """Rotation vector [..., 3], rad, of length [0, pi]; at exactly pi either sign is right."""
    q = quaternion_of_rotation(rotation)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., 3:])
    factor = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    vector: Array = q[..., :3] * factor
    return vector


def pose_of(position: ArrayLike, rotation: ArrayLike) -> Array:
    """Homogeneous [..., 4, 4] of position [..., 3] (m) and rotation [..., 3, 3]."""
    p, r = np.asarray(position, dtype=np.float64), np.asarray(rotation, dtype=np.float64)
    shape = np.broadcast_shapes(p.shape[:-1], r.shape[:-2])
    pose = np.zeros((*shape, 4, 4))
    pose[..., :3, :3] = r
    pose[..., :3, 3] = p
    pose[..., 3, 3] = 1.0
    return pose


def pose_of_quaternion(position: ArrayLike, quaternion: ArrayLike) -> Array:
    """[..., 4, 4].

    Raises:
        NotUnitQuaternion: as `unit_quaternion`.
    """
    return pose_of(position, rotation_of_quaternion(quaternion))


def pose_of_zyz(position: ArrayLike, angles: ArrayLike) -> Array:
    """[..., 4, 4] of position (m) and ZYZ angles (rad)."""
    return pose_of(position, rotation_of_zyz(angles))


def inverse_pose(pose: ArrayLike) -> Array:
    """[..., 4, 4]: the rigid inverse, exact transpose."""
    t = np.asarray(pose, dtype=np.float64)
    back = np.swapaxes(t[..., :3, :3], -1, -2)
    return pose_of(-(back @ t[..., :3, 3:])[..., 0], back)


def in_body(poses: ArrayLike, frame: Frame, base: ArrayLike) -> Array:
    """Poses [..., 4, 4] given in `frame`, as seen in O; `base` [4, 4] is the arm's base in O."""
    t = np.asarray(poses, dtype=np.float64)
    return np.asarray(base, dtype=np.float64) @ t if frame is Frame.BASE else t


def from_body(poses: ArrayLike, frame: Frame, base: ArrayLike) -> Array:
    """Poses [..., 4, 4] in O, as seen in `frame`; the inverse of `in_body`."""
    t = np.asarray(poses, dtype=np.float64)
    return inverse_pose(base) @ t if frame is Frame.BASE else t


def distances(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array]:
    """Between poses [..., 4, 4]: of the positions (m) and by the angle of the turn (rad), each [...]."""
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    turn = vector_of_rotation(np.swapaxes(a[..., :3, :3], -1, -2) @ b[..., :3, :3])
    return np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1), np.linalg.norm(turn, axis=-1)


def _matrix(*rows: tuple[Array, Array, Array]) -> Array:
    return np.stack([np.stack(np.broadcast_arrays(*row), axis=-1) for row in rows], axis=-2)
