"""Distances between segments, and between segments and boxes, many at once and exact."""

import numpy as np
from numpy.typing import NDArray

from axisync_robot.collision_loops import TINY
from axisync_robot.kernels import kernels

Array = NDArray[np.float64]


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def segment_to_segment(a: Array, b: Array) -> Array:
    """[m] distances of segments a[m, 2, 3] and b[m, 2, 3], which may be points, parallel or crossing (then 0).

    The nearest points of the two lines; each parameter clamped to its segment and the other one found anew.
    """
    compiled = kernels()
    if compiled is not None:
        out = np.empty(len(a))
        compiled.segment_to_segment(np.ascontiguousarray(a), np.ascontiguousarray(b), out)
        return out
    u, v, w = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], a[:, 0] - b[:, 0]
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw = _dot(u, w), _dot(v, w)
    cross = uu * vv - uv * uv
    s = np.where(cross > 1e-12 * uu * vv, (uv * vw - uw * vv) / np.maximum(cross, TINY), 0.0).clip(0.0, 1.0)
    t = ((uv * s + vw) / np.maximum(vv, TINY)).clip(0.0, 1.0)
    s = ((uv * t - uw) / np.maximum(uu, TINY)).clip(0.0, 1.0)
    gap = w + s[:, None] * u - t[:, None] * v
    distance: Array = np.sqrt(_dot(gap, gap))
    return distance


def segment_to_box(a: Array, half: Array) -> Array:
    """[m] distances of segments a[m, 2, 3] from boxes about the origin with half edges half[m, 3]; 0 inside.

    Along the segment the squared distance is convex and its slope piecewise linear, with corners where a coordinate
    passes a face: the slope's zero is found between the two corners around it.
    """
    compiled = kernels()
    if compiled is not None:
        out = np.empty(len(a))
        compiled.segment_to_box(np.ascontiguousarray(a), np.ascontiguousarray(half), out)
        return out
    start, step = a[:, 0], a[:, 1] - a[:, 0]
    safe = np.where(np.abs(step) > TINY, step, 1.0)
    faces = np.concatenate(((half - start) / safe, (-half - start) / safe), axis=1).clip(0.0, 1.0)
    ends = np.zeros((len(a), 2))
    ends[:, 1] = 1.0
    t = np.sort(np.concatenate((faces, ends), axis=1), axis=1)
    slope = _dot(_outside(start, step, half, t), step[:, None, :])
    row = np.arange(len(a))
    below = np.clip((slope <= 0.0).sum(axis=1) - 1, 0, t.shape[1] - 2)
    low, high = slope[row, below], slope[row, below + 1]
    part = (-low / np.maximum(high - low, TINY)).clip(0.0, 1.0)
    best = t[row, below] + part * (t[row, below + 1] - t[row, below])
    gap = _outside(start, step, half, best[:, None])[:, 0]
    distance: Array = np.sqrt(_dot(gap, gap))
    return distance


def _outside(start: Array, step: Array, half: Array, t: Array) -> Array:
    """[m, k, 3] by how much the points start + t step stand out of the box, each coordinate signed."""
    points = start[:, None, :] + t[:, :, None] * step[:, None, :]
    limit = half[:, None, :]
    beyond: Array = points - np.clip(points, -limit, limit)
    return beyond
