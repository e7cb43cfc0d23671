"""Degrees and millimetres at the edge, SI inside; arrays or plain sequences of numbers in, tuples on the wire."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_client.errors import InvalidArgument

Floats = Sequence[float] | NDArray[np.float64]
"""Plain numbers, flat: rad and m throughout."""


def deg(*degrees: float | ArrayLike) -> NDArray[np.float64]:
    """Radians of some degrees: `deg(-90, 60, -45, 0, 0, 0)` or `deg(array)`. Shape (n,), or that of the array."""
    return np.radians(_array(degrees))


def mm(*millimetres: float | ArrayLike) -> NDArray[np.float64]:
    """Metres of some millimetres: `mm(300, 0, 120)` or `mm(array)`. Shape (n,), or that of the array."""
    return _array(millimetres) / 1000.0


def to_deg(radians: ArrayLike) -> NDArray[np.float64]:
    """Degrees of some radians, in the same shape."""
    return np.degrees(np.asarray(radians, dtype=np.float64))


def to_mm(metres: ArrayLike) -> NDArray[np.float64]:
    """Millimetres of some metres, in the same shape."""
    return np.asarray(metres, dtype=np.float64) * 1000.0


def _array(values: tuple[float | ArrayLike, ...]) -> NDArray[np.float64]:
    return np.atleast_1d(np.asarray(values[0] if len(values) == 1 else values, dtype=np.float64))


def as_floats(values: Floats, name: str) -> tuple[float, ...]:
    """Finite floats of a flat sequence; `name` is what errors call it.

    Raises:
        InvalidArgument: not one-dimensional, empty, not numbers, or not finite.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise InvalidArgument(f"{name}: must be a flat sequence of numbers") from None
    if array.ndim != 1 or array.size == 0:
        raise InvalidArgument(f"{name}: has the shape {array.shape}, must be (n,): a flat sequence of numbers")
    if array.dtype.kind not in "fiu":
        raise InvalidArgument(f"{name}: must be numbers (radians, metres)")
    wrong = np.flatnonzero(~np.isfinite(array))
    if wrong.size:
        raise InvalidArgument(f"{name}[{wrong[0]}]: {array[wrong[0]]} is not finite")
    return tuple(float(value) for value in array)
