"""Distances and segments of collision_distance.py and collision_motion.py as loops, for compiled.py.

The same formulas once more, since what makes numpy fast makes loops slow, and a search measures few nodes at a time,
where numpy mostly waits for Python. What numba compiles must all be in here: its cache is valid while one file is
unchanged.
"""

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
TINY = 1e-30


def segment_ends(joints: Array, base: Array, owner: Indices, local: Array, q: Array, out: Array) -> None:
    """Fills out[m, c, 2, 3] at q[m, n] with the segments local[c, 2, 3], given in the frames of joints owner[c]."""
    turn, placed, origin = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for pose in range(q.shape[0]):
        for i in range(3):
            origin[i] = base[i, 3]
            for k in range(3):
                turn[i, k] = base[i, k]
        for joint in range(joints.shape[0]):
            step(joints[joint], q[pose, joint], turn, placed, origin)
            for capsule in range(owner.size):
                if owner[capsule] == joint:
                    place(local[capsule], turn, origin, out[pose, capsule])


def place(local: Array, turn: Array, origin: Array, out: Array) -> None:
    """Fills out[2, 3] with a segment, local[2, 3] in a frame."""
    for end in range(2):
        for i in range(3):
            out[end, i] = origin[i]
            for k in range(3):
                out[end, i] += turn[i, k] * local[end, k]


def step(joint: Array, angle: float, turn: Array, placed: Array, origin: Array) -> None:
    """To the next joint's frame: `turn` and `origin` are replaced."""
    c, s = cos(angle), sin(angle)
    for i in range(3):
        a, b, d = turn[i, 0], turn[i, 1], turn[i, 2]
        origin[i] += a * joint[0, 3] + b * joint[1, 3] + d * joint[2, 3]
        for k in range(3):
            placed[i, k] = a * joint[0, k] + b * joint[1, k] + d * joint[2, k]
    for i in range(3):
        turn[i, 0], turn[i, 1] = c * placed[i, 0] + s * placed[i, 1], c * placed[i, 1] - s * placed[i, 0]
        turn[i, 2] = placed[i, 2]


def segment_to_segment(a: Array, b: Array, out: Array) -> None:
    """Fills out[m] with the distances of segments a[m, 2, 3] and b[m, 2, 3]."""
    for m in range(out.size):
        uu, vv, uv, uw, vw = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            u, v, w = a[m, 1, i] - a[m, 0, i], b[m, 1, i] - b[m, 0, i], a[m, 0, i] - b[m, 0, i]
            uu, vv, uv, uw, vw = uu + u * u, vv + v * v, uv + u * v, uw + u * w, vw + v * w
        cross = uu * vv - uv * uv
        s = clamped((uv * vw - uw * vv) / max(cross, TINY)) if cross > 1e-12 * uu * vv else 0.0
        t = clamped((uv * s + vw) / max(vv, TINY))
        s = clamped((uv * t - uw) / max(uu, TINY))
        square = 0.0
        for i in range(3):
            u, v, w = a[m, 1, i] - a[m, 0, i], b[m, 1, i] - b[m, 0, i], a[m, 0, i] - b[m, 0, i]
            gap = w + s * u - t * v
            square += gap * gap
        out[m] = sqrt(square)


def segment_to_box(a: Array, half: Array, out: Array) -> None:
    """Fills out[m] with the distances of segments a[m, 2, 3] from boxes about the origin with half edges half[m, 3]."""
    t, slope = np.empty(8), np.empty(8)
    for m in range(out.size):
        corners(a, half, m, t)
        below = -1
        for k in range(8):
            slope[k] = 0.0
            for i in range(3):
                step_i = a[m, 1, i] - a[m, 0, i]
                slope[k] += outside(a[m, 0, i] + t[k] * step_i, half[m, i]) * step_i
            below += slope[k] <= 0.0
        below = min(max(below, 0), 6)
        part = clamped(-slope[below] / max(slope[below + 1] - slope[below], TINY))
        best = t[below] + part * (t[below + 1] - t[below])
        square = 0.0
        for i in range(3):
            gap = outside(a[m, 0, i] + best * (a[m, 1, i] - a[m, 0, i]), half[m, i])
            square += gap * gap
        out[m] = sqrt(square)


def corners(a: Array, half: Array, m: int, t: Array) -> None:
    """Fills t[8], ascending: where along segment m a coordinate passes a face of its box, and both ends."""
    for i in range(3):
        way = a[m, 1, i] - a[m, 0, i]
        safe = way if abs(way) > TINY else 1.0
        t[2 * i], t[2 * i + 1] = clamped((half[m, i] - a[m, 0, i]) / safe), clamped((-half[m, i] - a[m, 0, i]) / safe)
    t[6], t[7] = 0.0, 1.0
    for k in range(1, 8):
        value, i = t[k], k
        while i > 0 and t[i - 1] > value:
            t[i] = t[i - 1]
            i -= 1
        t[i] = value


def clamped(x: float) -> float:
    """To 0 ... 1."""
    return min(max(x, 0.0), 1.0)


def outside(x: float, limit: float) -> float:
    """By how much x is beyond -limit ... limit, signed."""
    return x - min(max(x, -limit), limit)
