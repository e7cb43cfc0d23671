"""Input checks shared by every entry point of the planner."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .closed_forms import DISTANCE_MAX, DISTANCE_MIN, DURATION_MAX, LIMIT_MAX, LIMIT_MIN, Array
from .errors import InvalidLimits

_LIMIT_BOUND = f"finite and within {LIMIT_MIN:g} .. {LIMIT_MAX:g}"
_DISTANCE_BOUND = f"finite, and 0 or of magnitude {DISTANCE_MIN:g} .. {DISTANCE_MAX:g}"
_DURATION_BOUND = f"finite and within 0 .. {DURATION_MAX:g}"


def check_axis(distance: float, v: float, a: float, j: float, axis: int | None = None) -> None:
    """Raise InvalidLimits unless one axis's distance and limits are usable (NaN fails every comparison)."""
    if not (LIMIT_MIN <= v <= LIMIT_MAX and LIMIT_MIN <= a <= LIMIT_MAX and LIMIT_MIN <= j <= LIMIT_MAX):
        _raise_limit(v, a, j, axis)
    if not (DISTANCE_MIN <= abs(distance) <= DISTANCE_MAX or distance == 0.0):
        raise InvalidLimits("distance", distance, _DISTANCE_BOUND, axis)


def _raise_limit(v: float, a: float, j: float, axis: int | None) -> None:
    for name, value in (("v_max", v), ("a_max", a), ("j_max", j)):
        if not LIMIT_MIN <= value <= LIMIT_MAX:
            raise InvalidLimits(name, value, _LIMIT_BOUND, axis)


def check_duration(duration: float, axis: int | None = None) -> None:
    """Raise InvalidLimits unless a duration is finite, not negative and representable in the closed forms."""
    if not 0.0 <= duration <= DURATION_MAX:
        raise InvalidLimits("duration", duration, _DURATION_BOUND, axis)


def floats(name: str, values: Sequence[float] | NDArray[np.float64], count: int | None = None) -> list[float]:
    """A vector as plain floats; ValueError if it is no vector or not of `count` elements."""
    try:
        result = list(map(float, values.tolist() if isinstance(values, np.ndarray) else values))
    except TypeError:
        raise ValueError(f"{name}: expected a vector, got shape {np.shape(values)}") from None
    if count is not None and len(result) != count:
        raise ValueError(f"{name}: expected {count} values, got {len(result)}")
    return result


def check_batch_shapes(
    distances: ArrayLike, v: ArrayLike, a: ArrayLike, j: ArrayLike
) -> tuple[Array, Array, Array, Array]:
    """Distances [m, n] and limits [n] as float64 arrays; ValueError for other shapes."""
    d = np.asarray(distances, dtype=np.float64)
    if d.ndim != 2:
        raise ValueError(f"distances: expected shape [moves, axes], got {d.shape}")
    limits = [np.asarray(limit, dtype=np.float64) for limit in (v, a, j)]
    for name, limit in zip(("v_max", "a_max", "j_max"), limits, strict=True):
        if limit.shape != (d.shape[1],):
            raise ValueError(f"{name}: expected shape {(d.shape[1],)}, got {limit.shape}")
    return d, limits[0], limits[1], limits[2]


def check_batch(d: Array, v: Array, a: Array, j: Array) -> None:
    """As check_axis for distances [m, n] and limits [n]."""
    for axis, limits in enumerate(zip(v.tolist(), a.tolist(), j.tolist(), strict=True)):
        check_axis(0.0, *limits, axis)
    size = np.abs(d)
    bad = ~(((size >= DISTANCE_MIN) & (size <= DISTANCE_MAX)) | (d == 0.0))
    if bad.any():
        move, axis = (int(i) for i in np.argwhere(bad)[0])
        check_axis(float(d[move, axis]), 1.0, 1.0, 1.0, axis)
