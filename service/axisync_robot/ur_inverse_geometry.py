"""Which arms have the geometry of a Universal Robots arm, and where their flange is, vectorised over paths."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_robot.chain import Chain, rotation_x, rotation_z

Array = NDArray[np.float64]

_ALPHA = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2)
_OFFSET = (False, True, True, False, False)
"""Which links have a length `a`."""
_SAME = 1e-12
"""Lengths (m) and entries of rotations may be off by so much: a thousandth of what solutions must keep."""
_SHORTEST = 1e-6
"""m: an upper arm or forearm shorter than this is none."""
_HALF_TURN = rotation_x(math.pi)


@dataclass(frozen=True, slots=True)
class UrGeometry:
    """Shoulder at height d1; upper arm a2 and forearm a3, parallel axes, offset d4 along them; wrist d5, d6 (m).

    The geometric angles are sign * q + theta (rad, [6] each).
    """

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    theta: tuple[float, ...]
    sign: tuple[float, ...] = (1.0,) * 6

    @property
    def longest(self) -> float:
        """How far the wrist (frame 4) reaches from the shoulder in the arm's plane."""
        return abs(self.a2) + abs(self.a3)

    @property
    def shortest(self) -> float:
        """How near the wrist comes to the shoulder in the arm's plane."""
        return abs(abs(self.a2) - abs(self.a3))

    @property
    def span(self) -> float:
        """No flange position is farther than this from the shoulder (0, 0, d1)."""
        return self.longest + abs(self.d4) + abs(self.d5) + abs(self.d6)

    def angles(self, q: Array) -> Array:
        """Geometric angles of joint angles q [..., 6], rad."""
        angles: Array = q * np.array(self.sign) + np.array(self.theta)
        return angles


@dataclass(frozen=True, slots=True, eq=False)
class UrArm:
    """A chain as one of these arms: `base` [4, 4] of the geometry in the chain's base, `flange` [4, 4] of the chain in
    the geometry's last frame."""

    geometry: UrGeometry
    base: Array
    flange: Array


def ur_arm(chain: Chain) -> UrArm | None:
    """The chain as a UR arm, or None where it is none.

    Its axes decide, not how it was described: 2, 3, 4 parallel, 1 and 2, 4 and 5, 5 and 6 crossing at right angles.
    Every placement is taken apart into Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha) Trans_z(d') Rot_z(theta'), whose
    last two belong to the next joint. Offsets along the parallel axes add to d4.
    """
    if len(chain) != 6:
        return None
    joints, flange, sign = _aligned(chain)
    theta, d, a = np.zeros(6), np.zeros(6), np.zeros(5)
    for i, (alpha, offset) in enumerate(zip(_ALPHA, _OFFSET, strict=True)):
        parts = _parallel(joints[i + 1]) if alpha == 0.0 else _crossing(joints[i + 1], alpha)
        if parts is None or (abs(parts[2]) <= _SHORTEST if offset else abs(parts[2]) > _SAME):
            return None
        theta[i] += parts[0]
        d[i] += parts[1]
        a[i] = parts[2]
        d[i + 1] += parts[3]
        theta[i + 1] += parts[4]
    d[5] += flange[2, 3]
    flange[2, 3] = 0.0
    turns = tuple(math.remainder(x, math.tau) for x in theta.tolist())
    d4 = float(d[1] + d[2] + d[3])
    geometry = UrGeometry(float(d[0]), float(a[1]), float(a[2]), d4, float(d[4]), float(d[5]), turns, sign)
    return UrArm(geometry, joints[0], flange)


def _aligned(chain: Chain) -> tuple[Array, Array, tuple[float, ...]]:
    """Placements and flange with axes 3 and 4 turned to point as axis 2 does, and the signs of the angles then.

    Rot_z(-q) = Rot_x(pi) Rot_z(q) Rot_x(pi).
    """
    joints, flange, sign = chain.joints.copy(), chain.flange.copy(), [1.0] * 6
    for i in (2, 3):
        if joints[i, 2, 2] < 0.0:
            joints[i, :3, :3] = joints[i, :3, :3] @ _HALF_TURN
            joints[i + 1, :3] = _HALF_TURN @ joints[i + 1, :3]
            sign[i] = -1.0
    return joints, flange, tuple(sign)


def _parallel(placement: Array) -> tuple[float, float, float, float, float] | None:
    """theta, d, a, d', theta' with alpha = 0; the sign of a such that theta is within 90 degrees; d' = 0."""
    if math.hypot(placement[0, 2], placement[1, 2]) > _SAME:
        return None
    x, y, z = placement[:3, 3].tolist()
    way = -1.0 if x < 0.0 else 1.0
    theta = math.atan2(way * y, way * x)
    turned = math.atan2(placement[1, 0], placement[0, 0])
    return theta, z, way * math.hypot(x, y), 0.0, turned - theta


def _crossing(placement: Array, alpha: float) -> tuple[float, float, float, float, float] | None:
    """theta, d, a, d', theta' with this alpha, a right angle either way."""
    if abs(placement[2, 2]) > _SAME:
        return None
    side = math.copysign(1.0, alpha)
    theta = math.atan2(side * placement[0, 2], -side * placement[1, 2])
    back = rotation_z(-theta)
    a, along, d = (back @ placement[:3, 3]).tolist()
    rest = rotation_x(-alpha) @ back @ placement[:3, :3]
    return theta, d, a, -side * along, math.atan2(rest[1, 0], rest[0, 0])


def forward(geometry: UrGeometry, q: Array) -> Array:
    """[..., 4, 4] pose of the flange in the arm's base at joint angles q [..., 6], rad.

    Everything lies in the plane that joint 1 turns: x1 = (c1, s1, 0), y1 = up, z1 = (s1, -c1, 0), its normal.
    """
    g = geometry
    q1, q2, q3, q4, q5, q6 = np.moveaxis(g.angles(q), -1, 0)
    q23 = q2 + q3
    phi = q23 + q4
    c1, s1, cp, sp = np.cos(q1), np.sin(q1), np.cos(phi), np.sin(phi)
    c5, s5, c6, s6 = np.cos(q5), np.sin(q5), np.cos(q6), np.sin(q6)
    u = g.a2 * np.cos(q2) + g.a3 * np.cos(q23) + g.d5 * sp
    w = g.a2 * np.sin(q2) + g.a3 * np.sin(q23) - g.d5 * cp
    # Columns in (x1, y1, z1); the pose's position is that of frame 5 plus d6 along the last.
    x6 = (c6 * c5 * cp - s6 * sp, c6 * c5 * sp + s6 * cp, c6 * s5)
    y6 = (-s6 * c5 * cp - c6 * sp, -s6 * c5 * sp + c6 * cp, -s6 * s5)
    z6 = (-s5 * cp, -s5 * sp, c5)
    at = (u + g.d6 * z6[0], w + g.d6 * z6[1], g.d4 + g.d6 * z6[2])
    pose = np.zeros((*q.shape[:-1], 4, 4))
    for column, (along, up, normal) in enumerate((x6, y6, z6, at)):
        pose[..., 0, column] = along * c1 + normal * s1
        pose[..., 1, column] = along * s1 - normal * c1
        pose[..., 2, column] = up
    pose[..., 2, 3] += g.d1
    pose[..., 3, 3] = 1.0
    return pose
