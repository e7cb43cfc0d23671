"""A path of joint angles as a collision search needs it: interpolated anywhere, its travel and spread bounded."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Track:
    """Samples q[k, m] of some axes, joined by straight lines in joint space; a place is a sample number, 2.5 too."""

    axes: Indices
    """[m], numbers within the cell."""
    q: Array
    """[k, m], rad."""
    spread: Array
    """[k, m], rad: around each sample every axis may be off by as much, either way."""
    travel: Array
    """[k, m], rad: each axis's way since the start, both directions counted."""

    @classmethod
    def of(cls, axes: ArrayLike, q: ArrayLike, spread: ArrayLike | None) -> "Track":
        """Checked and ready.

        Raises:
            ValueError: not k >= 1 rows of one finite angle an axis, or a spread that is negative or does not fit.
        """
        numbers, angles = np.asarray(axes, dtype=np.intp), np.asarray(q, dtype=np.float64)
        if angles.ndim != 2 or angles.shape[0] < 1 or angles.shape[1] != len(numbers):
            raise ValueError(f"a path of {len(numbers)} axes has shape [k, {len(numbers)}], not {angles.shape}")
        width = np.broadcast_to(np.asarray(0.0 if spread is None else spread, dtype=np.float64), angles.shape)
        if not np.isfinite(angles).all() or not np.isfinite(width).all() or (width < 0.0).any():
            raise ValueError("a path's angles and spread are finite, its spread is not negative")
        steps = np.abs(np.diff(angles, axis=0, prepend=angles[:1]))
        return cls(numbers, angles, width, np.cumsum(steps, axis=0))

    @property
    def end(self) -> float:
        """Number of the last sample."""
        return float(len(self.q) - 1)

    def at(self, places: Array) -> Array:
        """[u, m] joint angles."""
        return self._between(self.q, places)

    def turn(self, low: Array, middle: Array, high: Array) -> Array:
        """[u, m] no axis is further from where it is at `middle`, anywhere between `low` and `high`."""
        here = self._between(self.travel, middle)
        turn: Array = np.maximum(here - self._between(self.travel, low), self._between(self.travel, high) - here)
        return turn

    def widest(self, low: Array, high: Array) -> Array:
        """[u, m] greatest spread between two places, the samples around them included."""
        if not self.spread.any():
            return np.zeros((len(low), len(self.axes)))
        bounds = np.stack((np.floor(low), np.ceil(high) + 1.0), axis=1).astype(np.intp).ravel()
        padded = np.concatenate((self.spread, np.zeros((1, len(self.axes)))))
        widest: Array = np.maximum.reduceat(padded, bounds, axis=0)[::2]
        return widest

    def _between(self, values: Array, places: Array) -> Array:
        low = np.minimum(places.astype(np.intp), max(len(values) - 2, 0))
        high = np.minimum(low + 1, len(values) - 1)
        part = (places - low)[:, None]
        between: Array = values[low] + part * (values[high] - values[low])
        return between
