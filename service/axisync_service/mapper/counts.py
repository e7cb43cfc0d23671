"""Axis positions to drive counts (INT32, wrapping) and back."""

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.cell import Axis

INT32_SPAN = 2**32
FINEST = 0.25
"""Positions of counts are whole multiples of a power of two, at most this many counts: their zeros pack well in a log,
and the count comes back exactly."""


class CountMap:
    """counts = round((position - offset) * counts_per_rad), for all axes of a cell at once."""

    def __init__(self, axes: tuple[Axis, ...]) -> None:
        self._scale = np.array([axis.drive.counts_per_rad for axis in axes])
        self._offset = np.array([axis.drive.offset for axis in axes])
        self._step: NDArray[np.float64] = 2.0 ** np.floor(np.log2(FINEST / np.abs(self._scale)))

    def to_counts(self, position: NDArray[np.float64]) -> NDArray[np.int64]:
        """[n] rad -> [n] counts, before INT32 wraps."""
        turns: NDArray[np.float64] = position - self._offset
        turns *= self._scale
        counts: NDArray[np.int64] = np.rint(turns, out=turns).astype(np.int64)
        return counts

    def to_position(self, counts: NDArray[np.int64]) -> NDArray[np.float64]:
        """[n] counts -> [n] rad, to `FINEST`."""
        position: NDArray[np.float64] = counts / self._scale
        position += self._offset
        position /= self._step
        np.rint(position, out=position)
        position *= self._step
        return position


def wrap_int32(counts: int) -> int:
    """Counts as the 32-bit object holds them."""
    return (counts + 2**31) % INT32_SPAN - 2**31


def unwrap_int32(raw: int, near: int) -> int:
    """The count whose INT32 value is `raw` and which is nearest to `near`: no jump where the object wraps."""
    return near + (raw - near + 2**31) % INT32_SPAN - 2**31
