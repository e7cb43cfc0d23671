"""Which arms have the geometry of a Universal Robots arm, and where their tool is, vectorised over paths."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import DenavitHartenberg

Array = NDArray[np.float64]

ALPHA = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)
_SAME = 1e-12
"""Lengths (m) and angles (rad) of the table may be off by so much: a thousandth of what solutions must keep."""


@dataclass(frozen=True, slots=True)
class UrGeometry:
    """Shoulder at height d1; upper arm a2 and forearm a3, parallel axes, offset d4 along them; wrist d5, d6 (m).

    theta [6] is added to the joint angles (rad).
    """

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    theta: tuple[float, ...]

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
        """No tool position is farther than this from the shoulder (0, 0, d1)."""
        return self.longest + abs(self.d4) + abs(self.d5) + abs(self.d6)


def ur_geometry(rows: Sequence[DenavitHartenberg]) -> UrGeometry | None:
    """The geometry, or None where these rows are no arm of this kind.

    alpha = 90, 0, 0, 90, -90, 0 deg; a only in rows 2 and 3, neither zero. Axes 2, 3, 4 are parallel, so that d2 and d3
    (zero in a real arm) add to d4.
    """
    if len(rows) != 6:
        return None
    turned = any(abs(row.alpha - alpha) > _SAME for row, alpha in zip(rows, ALPHA, strict=True))
    offset = any(abs(rows[i].a) > _SAME for i in (0, 3, 4, 5))
    if turned or offset or min(abs(rows[1].a), abs(rows[2].a)) <= 1e-6:
        return None
    d4 = rows[1].d + rows[2].d + rows[3].d
    theta = tuple(row.theta for row in rows)
    return UrGeometry(rows[0].d, rows[1].a, rows[2].a, d4, rows[4].d, rows[5].d, theta)


def forward(geometry: UrGeometry, q: Array) -> Array:
    """[..., 4, 4] pose of the tool in the arm's base at joint angles q [..., 6], rad.

    Everything lies in the plane that joint 1 turns: x1 = (c1, s1, 0), y1 = up, z1 = (s1, -c1, 0), its normal.
    """
    g = geometry
    q1, q2, q3, q4, q5, q6 = np.moveaxis(q + np.array(g.theta), -1, 0)
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
