"""Inverse kinematics of UR geometry in closed form: all eight branches, or one, of every pose of a path at once.

Lanes are the last dimension inside: [k] poses, [2, k] shoulders, [2, 2, k] (wrist, shoulder); 1 where one branch is
asked for. A branch's index is
4 shoulder + 2 elbow + wrist:
    shoulder 0: the wrist's centre lies on the +x side of frame 1, 1: on the other side
    elbow    0: q3 in [0, pi], 1: in [-pi, 0]
    wrist    0: q5 in [0, pi], 1: in [-pi, 0]   (geometric angles, theta offsets included)
Where two branches meet (at a singularity) both stay valid and have the same angles.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_robot.poses import inverse_pose
from axisync_robot.ur_inverse_geometry import UrGeometry, forward

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BRANCHES = 8
REACH_TOLERANCE = 1e-10
"""m: a pose this far out of reach still counts as reached, stretched: rounding, a tenth of what solutions must keep."""
_SHOULDER_MEETS = 1e-13
"""m: where the two shoulders are this near to meeting, the square root of rounding decides; they are one."""
_WRIST_SINGULAR = 1e-10
"""Sine of q5 below which only q4 +- q6 is defined; q5 is then 0 or pi exactly, at most this much off."""
_WRIST_NEAR = 1e-3
"""Sine of q5 below which the rounding of q6 may cost the elbow its reach."""
_TURN_ROUNDING = 1e-10
"""rad: what the tool's orientation may give so that the elbow reaches: a tenth of what solutions must keep."""
_FREE = 1e-12
"""m: a lever this short leaves its angle free."""
_LIMIT_ROUNDING = 1e-12


def wrapped(angle: Array) -> Array:
    """The same angles within half a turn either way, rad."""
    return angle - math.tau * np.rint(angle / math.tau)


@dataclass(frozen=True, slots=True)
class Solutions:
    """Of k poses.

    Attributes:
        angles: [k, 8, 6], rad, nearest the reference as limits allow; nan where out of reach.
        reachable: [k, 8].
        within: [k, 8], reachable with every joint within its limits.
        free: [k, 8], the wrist is singular: q6 was taken from the reference, or as near to it as the elbow reaches.
    """

    angles: Array
    reachable: Mask
    within: Mask
    free: Mask


@dataclass(frozen=True, slots=True)
class _Wrist:
    """Per [2, 2, k]: q5, q6, direction of the axis of joint 5 in the arm's plane; sine of q5 [2, k]."""

    q5: Array
    q6: Array
    along: Array
    up: Array
    sine: Array


@dataclass(frozen=True, slots=True)
class _Sides:
    """Which branches are solved: every combination of these; 1.0 is side 0, -1.0 side 1."""

    shoulder: tuple[float, ...]
    elbow: tuple[float, ...]
    wrist: tuple[float, ...]

    @classmethod
    def of(cls, branch: int) -> "_Sides":
        """One branch."""
        shoulder, elbow, wrist = (1.0 - 2.0 * (branch >> bit & 1) for bit in (2, 1, 0))
        return cls((shoulder,), (elbow,), (wrist,))

    @property
    def count(self) -> int:
        return len(self.shoulder) * len(self.elbow) * len(self.wrist)


_ALL = _Sides((1.0, -1.0), (1.0, -1.0), (1.0, -1.0))


class UrInverse:
    """The solver of one arm."""

    def __init__(
        self, geometry: UrGeometry, base: ArrayLike, low: ArrayLike, high: ArrayLike, tool: ArrayLike | None = None
    ) -> None:
        """`base` [4, 4] in O; limits low, high [6], rad; `tool` [4, 4] in the geometry's last frame."""
        self.geometry = geometry
        self.base = np.asarray(base, dtype=np.float64)
        self.low = np.asarray(low, dtype=np.float64)
        self.high = np.asarray(high, dtype=np.float64)
        self.tool = np.eye(4) if tool is None else np.asarray(tool, dtype=np.float64)
        self._to_base = inverse_pose(self.base)
        self._to_flange = inverse_pose(self.tool)

    @property
    def centre(self) -> Array:
        """[3]: the shoulder in O, m."""
        centre: Array = self.base[:3, :3] @ np.array([0.0, 0.0, self.geometry.d1]) + self.base[:3, 3]
        return centre

    def flange(self, poses: ArrayLike) -> Array:
        """[..., 4, 4] where the flange is, in O, when the tool stands at poses [..., 4, 4] in O."""
        targets = np.asarray(poses, dtype=np.float64)
        flange: Array = (targets.reshape(-1, 4) @ self._to_flange).reshape(targets.shape)
        return flange

    def forward(self, q: ArrayLike) -> Array:
        """[..., 4, 4] poses of the tool in O at joint angles q [..., 6], rad."""
        poses: Array = self.base @ forward(self.geometry, np.asarray(q, dtype=np.float64)) @ self.tool
        return poses

    def solve(self, poses: ArrayLike, reference: ArrayLike) -> Solutions:
        """All branches of poses [k, 4, 4] in O; reference [6] or [k, 6], rad.

        Raises:
            ValueError: not poses of that shape, or not finite.
        """
        q, near, reachable, free = self._nearest(poses, reference, _ALL)
        within = self._shift(q, near) & reachable
        q[:, ~reachable] = np.nan
        return Solutions(np.ascontiguousarray(q.transpose(2, 1, 0)), reachable.T, within.T, free.T)

    def solve_unlimited(
        self, poses: ArrayLike, reference: ArrayLike, branch: int | None = None
    ) -> tuple[Array, Mask, Mask]:
        """As `solve`, without regard to limits: angles within half a turn of the reference, reachable and free.

        Of one `branch` only [k, 1, 6], [k, 1], [k, 1], where that is given: the same values, in a third of the time.

        Raises:
            ValueError: as `solve`.
        """
        q, near, reachable, free = self._nearest(poses, reference, _ALL if branch is None else _Sides.of(branch))
        q += np.rint((near[:, None] - q) / math.tau) * math.tau
        q[:, ~reachable] = np.nan
        return np.ascontiguousarray(q.transpose(2, 1, 0)), reachable.T, free.T

    def _nearest(self, poses: ArrayLike, reference: ArrayLike, sides: _Sides) -> tuple[Array, Array, Mask, Mask]:
        """Joint angles [6, b, k] not yet turned near the reference [6, k]; reachable and free [b, k] of b branches."""
        targets = np.asarray(poses, dtype=np.float64)
        if targets.ndim != 3 or targets.shape[1:] != (4, 4) or not np.isfinite(targets).all():
            raise ValueError(f"finite poses [k, 4, 4] are expected, not {targets.shape}")
        near = np.broadcast_to(np.asarray(reference, dtype=np.float64), (len(targets), 6)).T
        entries = np.ascontiguousarray(self.flange(targets).transpose(1, 2, 0))
        entries = (self._to_base @ entries.reshape(4, -1)).reshape(4, 4, -1)
        q, reachable, free = self._solve(entries, self.geometry.angles(near.T).T, sides)
        q -= np.array(self.geometry.theta)[:, None, None]
        q *= np.array(self.geometry.sign)[:, None, None]
        return q, near, reachable, free

    def _solve(self, entries: Array, near: Array, sides: _Sides) -> tuple[Array, Mask, Mask]:
        """Geometric angles [6, b, k], reachable and free [b, k], of flanges [4, 4, k] in the arm's base."""
        g = self.geometry
        x6, y6, z6 = entries[:3, 0], entries[:3, 1], entries[:3, 2]
        fifth = entries[:3, 3] - g.d6 * z6
        q1, ok = self._shoulder(fifth, near[0], sides.shoulder)
        c1, s1 = np.cos(q1), np.sin(q1)
        u, w = fifth[0] * c1 + fifth[1] * s1, np.broadcast_to(fifth[2] - g.d1, q1.shape)
        wrist = self._wrist((x6, y6, z6), c1, s1, sides.wrist)
        if (wrist.sine < _WRIST_NEAR).any():
            self._free_wrist(wrist, (x6, y6), (c1, s1), (u, w), near[5])
        q2, q3, reached = self._elbow(u - g.d5 * wrist.along, w - g.d5 * wrist.up, near[1], sides.elbow)
        phi = np.arctan2(wrist.along, -wrist.up)
        q = np.empty((6, *map(len, (sides.shoulder, sides.elbow, sides.wrist)), entries.shape[2]))
        q[0] = q1[:, None, None]
        q[4] = wrist.q5.swapaxes(0, 1)[:, None]
        q[5] = wrist.q6.swapaxes(0, 1)[:, None]
        q[1] = q2.transpose(2, 0, 1, 3)
        q[2] = q3.transpose(2, 0, 1, 3)
        q[3] = phi.swapaxes(0, 1)[:, None] - q[1] - q[2]
        reachable = np.broadcast_to((reached & ok).swapaxes(0, 1)[:, None], q.shape[1:])
        free = np.broadcast_to((wrist.sine < _WRIST_SINGULAR)[:, None, None], q.shape[1:])
        branches = (sides.count, entries.shape[2])
        return q.reshape(6, *branches), reachable.reshape(branches), free.reshape(branches)

    def _shoulder(self, fifth: Array, near: Array, sides: tuple[float, ...]) -> tuple[Array, Mask]:
        """q1 [s, k]: frame 5 must lie d4 beside the arm's plane, r sin(q1 - psi) = d4; reachable [k]."""
        d4 = self.geometry.d4
        r = np.hypot(fifth[0], fifth[1])
        beside = r - abs(d4)
        ahead = np.sqrt(np.where(beside < _SHOULDER_MEETS, 0.0, beside * (r + abs(d4))))
        psi = np.arctan2(fifth[1], fifth[0])
        q1 = psi + np.stack([np.arctan2(d4, side * ahead) for side in sides])
        return np.where(r < _FREE, near, q1), beside >= -REACH_TOLERANCE

    @staticmethod
    def _wrist(tool: tuple[Array, Array, Array], c1: Array, s1: Array, sides: tuple[float, ...]) -> _Wrist:
        """The plane's normal z1 seen from the tool is (s5 c6, -s5 s6, c5); the axis of joint 5 is -y5."""
        x6, y6, _ = tool
        px, py, pz = (v[0] * s1 - v[1] * c1 for v in tool)
        sine = np.hypot(px, py)
        singular = sine < _WRIST_SINGULAR
        safe = np.where(singular, 1.0, sine)
        q5 = np.arctan2(np.where(singular, 0.0, sine), pz)
        s6, c6 = -py / safe, px / safe
        along = -(s6 * (x6[0] * c1 + x6[1] * s1) + c6 * (y6[0] * c1 + y6[1] * s1))
        up = -(s6 * x6[2] + c6 * y6[2])
        q6 = np.arctan2(s6, c6)
        half_turns = [q6 + (0.0 if side > 0.0 else math.pi) for side in sides]
        q5s, alongs, ups = (np.stack([side * value for side in sides]) for value in (q5, along, up))
        return _Wrist(q5s, np.stack(half_turns), alongs, ups, sine)

    def _free_wrist(
        self, wrist: _Wrist, tool: tuple[Array, Array], turn: tuple[Array, Array], at: tuple[Array, Array], near: Array
    ) -> None:
        """Turns q6, in lanes at or near the wrist's singularity, as far as the elbow needs to reach.

        Where it is singular q6 starts from the reference and may go anywhere; near it, a turn that alters the tool's
        orientation by no more than rounding is allowed: q6 itself is known no better there.
        Turning joint 5's axis by delta moves the wrist along a circle of radius d5, at distance
        rho^2 = C^2 + d5^2 - 2 C d5 cos(delta - gamma) from the shoulder; rho must lie between shortest and longest.
        """
        g, (shoulder, lane) = self.geometry, np.nonzero(wrist.sine < _WRIST_NEAR)
        x6, y6 = tool[0][:, lane], tool[1][:, lane]
        c1, s1, u, w, sine = (values[shoulder, lane] for values in (*turn, *at, wrist.sine))
        singular = sine < _WRIST_SINGULAR
        q6 = np.where(singular, near[lane], wrist.q6[:, shoulder, lane])
        axis = -(np.sin(q6) * x6[:, None] + np.cos(q6) * y6[:, None])
        far, arm = np.hypot(u, w), abs(g.d5)
        gamma = np.arctan2(w, u) + (math.pi if g.d5 < 0.0 else 0.0)
        apart = np.remainder(np.arctan2(axis[2], axis[0] * c1 + axis[1] * s1) - gamma + math.pi, math.tau) - math.pi
        lever = np.maximum(2.0 * far * arm, _FREE**2)
        widest = np.arccos(np.clip((far**2 + arm**2 - g.longest**2) / lever, -1.0, 1.0))
        least = np.arccos(np.clip((far**2 + arm**2 - g.shortest**2) / lever, -1.0, 1.0))
        reaching = np.copysign(np.clip(np.abs(apart), least, widest), apart)
        allowed = singular | (np.abs(reaching - apart) * sine <= _TURN_ROUNDING)
        delta = gamma + np.where(allowed, reaching, apart)
        along, up = np.cos(delta), np.sin(delta)
        x4, y4 = along * c1, along * s1
        q6 = np.arctan2(-(x4 * x6[0] + y4 * x6[1] + up * x6[2]), -(x4 * y6[0] + y4 * y6[1] + up * y6[2]))
        for target, value in ((wrist.q6, q6), (wrist.along, along), (wrist.up, up)):
            target[:, shoulder, lane] = value

    def _elbow(self, u: Array, w: Array, near: Array, sides: tuple[float, ...]) -> tuple[Array, Array, Mask]:
        """q2, q3 [elbows, wrists, shoulders, k] and reachable [wrists, shoulders, k].

        u + iw = e^(i q2) (a2 + a3 e^(i q3)).

        The sine by Heron's product, in which nothing cancels when the arm is stretched or folded.
        """
        a2, a3, longest, shortest = self.geometry.a2, self.geometry.a3, self.geometry.longest, self.geometry.shortest
        rho = np.hypot(u, w)
        reached = (rho <= longest + REACH_TOLERANCE) & (rho >= shortest - REACH_TOLERANCE)
        heron = (rho - shortest) * (rho + shortest) * (longest - rho) * (longest + rho)
        s3 = np.sqrt(np.maximum(heron, 0.0)) / (2.0 * abs(a2 * a3))
        c3 = (rho * rho - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
        q3 = np.arctan2(s3, c3)
        aim, lead = np.arctan2(w, u), np.arctan2(a3 * s3, a2 + a3 * c3)
        aim = np.where(rho < _FREE, near + lead, aim)
        q2s, q3s = np.stack([aim - side * lead for side in sides]), np.stack([side * q3 for side in sides])
        return q2s, q3s, reached

    def _shift(self, q: Array, near: Array) -> Mask:
        """Turns q [6, 8, k] in place by whole turns to be nearest `near` [6, k], within limits where it can; [8, k]."""
        q += np.rint((near[:, None] - q) / math.tau) * math.tau
        low, high = self.low - _LIMIT_ROUNDING, self.high + _LIMIT_ROUNDING
        outside = (q < low[:, None, None]) | (q > high[:, None, None])
        if outside.any():
            at = np.nonzero(outside)
            angle = q[at]
            least, most = np.ceil((low[at[0]] - angle) / math.tau), np.floor((high[at[0]] - angle) / math.tau)
            possible = least <= most
            q[at] = angle + np.where(possible, np.clip(0.0, least, most), 0.0) * math.tau
            outside[at] = ~possible
        return ~np.asarray(outside.any(axis=0), dtype=np.bool_)
