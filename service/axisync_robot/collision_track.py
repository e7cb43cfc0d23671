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
    spreads: Array
    """[s, k, m], rad: around each sample every axis may be off by as much, either way; for s questions at once."""
    travel: Array
    """[k, m], rad: each axis's way since the start, both directions counted."""
    peaks: Array
    """[levels, k, s, m]: the greatest spreads of a sample and the 2^level - 1 that follow it."""

    @classmethod
    def of(cls, axes: ArrayLike, q: ArrayLike, *spreads: ArrayLike | None) -> "Track":
        """Checked and ready, with spreads[k, m] or [m] each; None: there is none.

        Raises:
            ValueError: not k >= 1 rows of one finite angle an axis, or a spread that is negative or does not fit.
        """
        numbers, angles = np.asarray(axes, dtype=np.intp), np.asarray(q, dtype=np.float64)
        if angles.ndim != 2 or angles.shape[0] < 1 or angles.shape[1] != len(numbers):
            raise ValueError(f"a path of {len(numbers)} axes has shape [k, {len(numbers)}], not {angles.shape}")
        widths = np.empty((len(spreads), *angles.shape))
        for width, spread in zip(widths, spreads, strict=True):
            width[:] = 0.0 if spread is None else spread
        if not np.isfinite(angles).all() or not np.isfinite(widths).all() or (widths < 0.0).any():
            raise ValueError("a path's angles and spread are finite, its spread is not negative")
        travel = np.zeros_like(angles)
        np.cumsum(np.abs(np.diff(angles, axis=0)), axis=0, out=travel[1:])
        return cls(numbers, angles, widths, travel, _peaks(widths.transpose(1, 0, 2)))

    @property
    def end(self) -> float:
        """Number of the last sample."""
        return float(len(self.q) - 1)

    def at(self, places: Array) -> Array:
        """[u, m] joint angles."""
        low, high, part = self.between(places)
        angles: Array = self.q[low] + part[:, None] * (self.q[high] - self.q[low])
        return angles

    def between(self, places: Array) -> tuple[Indices, Indices, Array]:
        """[u] each: the samples before and after, and how far from the one to the other."""
        low = np.minimum(places.astype(np.intp), max(len(self.q) - 2, 0))
        return low, np.minimum(low + 1, len(self.q) - 1), places - low

    def widest(self, low: Array, high: Array) -> Array:
        """[u, s, m] greatest spreads between two places, the samples around them included."""
        first, end = low.astype(np.intp), np.ceil(high).astype(np.intp) + 1
        level = np.frexp(end - first)[1] - 1
        widest: Array = np.maximum(self.peaks[level, first], self.peaks[level, end - (1 << level)])
        return widest


def _peaks(spreads: Array) -> Array:
    """Of spreads [k, s, m]; the greatest of any range is the greater of two that begin and end with it."""
    levels = [spreads]
    for level in range(len(spreads).bit_length() - 1):
        above, step = levels[-1].copy(), 1 << level
        np.maximum(above[:-step], above[step:], out=above[:-step])
        levels.append(above)
    return np.array(levels)
