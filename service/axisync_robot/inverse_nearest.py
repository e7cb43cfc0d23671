"""How far a pose is from what a UR arm reaches, and the nearest pose of the same orientation that it does reach."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_robot.ur_inverse import UrInverse

Array = NDArray[np.float64]

_GRID = 96
_REFINEMENTS = 6
_CONE_ROUNDS = 14
_CONE = 16
_WIDEST = 0.7


@dataclass(frozen=True, slots=True)
class Nearest:
    """A reachable pose [4, 4] in O within the joint limits, and its distance (m) from the one asked for."""

    pose: Array
    distance: float


def nearest_reachable(inverse: UrInverse, pose: Array, reference: Array) -> Nearest | None:
    """The nearest position, to about 1e-6 of the distance, that is reached with the same orientation.

    A search: first along rays to the shoulder and 26 others, then in narrowing cones about the best. None where the
    joint limits leave nothing on any ray.
    """
    towards = inverse.centre - inverse.flange(pose)[:3, 3]
    far = float(np.linalg.norm(towards))
    rays = _unit(np.vstack([towards if far > 0.0 else np.array([0.0, 0.0, 1.0]), _cube()]))
    least = max(0.0, far - inverse.geometry.span)
    search = _Search(inverse, pose, reference)
    if search.reached(rays[:1], np.zeros(1))[0, 0]:
        return Nearest(pose.copy(), 0.0)
    best = search.first(rays, least, far + inverse.geometry.span)
    if best is None:
        return None
    ray, distance = best
    for angle in _WIDEST * 0.5 ** np.arange(_CONE_ROUNDS):
        closest = max(least, distance * (1.0 - 2.0 * angle))
        better = search.first(_around(ray, angle), closest, distance)
        if better is not None and better[1] < distance:
            ray, distance = better
    return Nearest(_moved(pose, ray * distance), distance)


@dataclass(frozen=True, slots=True)
class _Search:
    inverse: UrInverse
    pose: Array
    reference: Array

    def reached(self, rays: Array, radii: Array) -> NDArray[np.bool_]:
        """[rays, radii]."""
        moves = rays[:, None] * radii[:, None]
        poses = np.broadcast_to(self.pose, (*moves.shape[:2], 4, 4)).copy()
        poses[..., :3, 3] += moves
        within = self.inverse.solve(poses.reshape(-1, 4, 4), self.reference).within
        return np.asarray(within.any(axis=1), dtype=np.bool_).reshape(moves.shape[:2])

    def first(self, rays: Array, low: float, high: float) -> tuple[Array, float] | None:
        """The ray reached soonest between the radii, and where, to rounding; the result itself is reached."""
        radii = np.linspace(low, high, _GRID)
        hits = self.reached(rays, radii)
        soonest = np.where(hits.any(axis=1), hits.argmax(axis=1), _GRID)
        ray, at = int(soonest.argmin()), int(soonest.min())
        if at == _GRID:
            return None
        low, high = float(radii[max(0, at - 1)]), float(radii[at])
        for _ in range(_REFINEMENTS):
            radii = np.linspace(low, high, _GRID)
            at = int(self.reached(rays[ray : ray + 1], radii)[0].argmax())
            low, high = float(radii[max(0, at - 1)]), float(radii[at])
        return rays[ray], high


def _moved(pose: Array, by: Array) -> Array:
    moved = pose.copy()
    moved[:3, 3] += by
    return moved


def _cube() -> Array:
    """[26, 3]: faces, edges and corners."""
    grid = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
    kept: Array = grid[np.abs(grid).max(axis=1) > 0.0]
    return kept


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _around(ray: Array, angle: float) -> Array:
    """[16, 3]: unit vectors at `angle` (rad) from the ray, and the ray itself is not among them."""
    across = np.cross(ray, np.eye(3)[int(np.abs(ray).argmin())])
    across /= np.linalg.norm(across)
    turns = np.arange(_CONE) * math.tau / _CONE
    ring = np.outer(np.cos(turns), across) + np.outer(np.sin(turns), np.cross(ray, across))
    directions: Array = math.cos(angle) * ray + math.sin(angle) * ring
    return directions
