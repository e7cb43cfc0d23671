"""Degrees at the edge, radians inside; arrays or plain sequences of numbers in, tuples of floats on the wire."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_client.errors import InvalidArgument

Floats = Sequence[float] | NDArray[np.float64]
"""One value for each axis, rad (m for linear axes)."""


def deg(*degrees: float | ArrayLike) -> NDArray[np.float64]:
    """Radians of some degrees: `deg(-90, 60, -45, 0, 0, 0)` or `deg(array)`. Shape (n,), or that of the array."""
    values = degrees[0] if len(degrees) == 1 else degrees
    return np.atleast_1d(np.radians(np.asarray(values, dtype=np.float64)))


def to_deg(radians: ArrayLike) -> NDArray[np.float64]:
    """Degrees of some radians, in the same shape."""
    return np.degrees(np.asarray(radians, dtype=np.float64))


def as_target(values: Floats) -> tuple[float, ...]:
    """One finite float for each axis.

    Raises:
        InvalidArgument: not one-dimensional, empty, not numbers, or not finite.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise InvalidArgument("target: must be a flat sequence of numbers, one for each axis") from None
    if array.ndim != 1 or array.size == 0:
        raise InvalidArgument(f"target: has the shape {array.shape}, must be (n,), one number for each axis")
    if array.dtype.kind not in "fiu":
        raise InvalidArgument("target: must be numbers (radians)")
    wrong = np.flatnonzero(~np.isfinite(array))
    if wrong.size:
        raise InvalidArgument(f"target[{wrong[0]}]: {array[wrong[0]]} is not finite")
    return tuple(float(value) for value in array)
