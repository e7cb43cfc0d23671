"""The trajectory of a synchronised move: all axes' segments on common knots."""

import numpy as np
from numpy.typing import ArrayLike

from .closed_forms import Array
from .masa import SyncProfile
from .s_curve import phases, rising_states
from .trajectory import Trajectory

RESOLUTION = 4.0 * float(np.finfo(np.float64).eps)  # of the duration: boundaries closer than this are one knot
FACTORIALS = np.array([1.0, 1.0, 2.0, 6.0, 24.0, 120.0])


def from_profiles(start: ArrayLike, sync_profile: SyncProfile, target: ArrayLike | None = None) -> Trajectory:
    """The move of `sync_profile` from position start[n]: cubics, or quintics for the parabolic pulse.

    `target`[n] is the exact position to end at (default start + distances); it must be that within rounding, since
    the distances were rounded from it. ValueError otherwise, and for wrong shapes.
    """
    origin = np.array(start, dtype=np.float64)
    n = sync_profile.distances.size
    if origin.shape != (n,):
        raise ValueError(f"start: expected {n} values, got shape {origin.shape}")
    end = origin + sync_profile.distances if target is None else _checked_target(origin, sync_profile, target)
    knots = _knots(sync_profile)
    return Trajectory(knots, _coefficients(knots, sync_profile, origin, end), origin, end)


def _checked_target(start: Array, profile: SyncProfile, target: ArrayLike) -> Array:
    end = np.array(target, dtype=np.float64)
    if end.shape != start.shape:
        raise ValueError(f"target: expected {start.size} values, got shape {end.shape}")
    error = np.abs(end - start - profile.distances)
    allowed = RESOLUTION * (np.abs(start) + np.abs(end))
    wrong = ~(error <= allowed)
    if wrong.any():
        axis = int(np.argmax(wrong))
        reached = float(start[axis] + profile.distances[axis])
        raise ValueError(f"target, axis {axis}: {float(end[axis])!r}, but the profile ends at {reached!r}")
    return end


def _knots(profile: SyncProfile) -> Array:
    """All axes' segment boundaries, sorted, those closer than the resolution merged."""
    t = profile.duration
    moving = profile.U[:, 0] != 0.0
    tj, ta = profile.T[moving, 0], profile.T[moving, 1]
    rising = np.concatenate([tj, tj + ta, tj + ta + tj])
    boundaries = np.sort(np.concatenate([rising, t - rising])).tolist()
    resolution = RESOLUTION * t
    knots = [0.0]
    for boundary in boundaries:
        if knots[-1] + resolution < boundary < t - resolution:
            knots.append(boundary)
    if t > 0.0:
        knots.append(t)
    return np.array(knots)


def _coefficients(knots: Array, profile: SyncProfile, start: Array, end: Array) -> Array:
    """Each segment's polynomial: the axis's phase in its middle, expanded about its first knot."""
    curve = profile.curve()
    middle = 0.5 * (knots[:-1] + knots[1:])[:, np.newaxis]
    mirrored = middle > 0.5 * profile.duration
    tau = np.where(mirrored, profile.duration - middle, middle)
    shape = (middle.shape[0], start.size)
    phase = phases(np.broadcast_to(tau, shape), curve.tj, curve.ta)
    knot = knots[:-1, np.newaxis]
    tau = np.where(mirrored, profile.duration - knot, knot)
    states = rising_states(np.broadcast_to(tau, shape), phase, curve, profile.pulse)
    states[0] = np.where(mirrored, end - states[0], start + states[0])
    states[2::2] = np.where(mirrored, -states[2::2], states[2::2])
    order = 4 if profile.pulse == "constant" else 6
    return np.ascontiguousarray((states[:order] / FACTORIALS[:order, None, None]).transpose(1, 0, 2))
