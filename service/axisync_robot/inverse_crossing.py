"""Where a path passes straight through a singularity: which branch the joints go on with, if only one is smooth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_robot.ur_inverse import wrapped

Array = NDArray[np.float64]

SHARE = 0.25
"""Joints' steps may differ from one sample to the next by this share of the larger: they differ by far less on a path
sampled finely enough for anything else, and by about as much as they are long where the arm would have to swing round.

A path that misses the singularity by e rad and steps by h is let through where e is below about 0.05 h^2."""
_ROUNDING = 1e-9
"""rad."""
_SAME = 1e-5
"""rad: branches this near each other are one."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """The last sample before and the first one after, the branch there, and between [m, 6], rad: the singular ones."""

    before: int
    after: int
    branch: int
    between: Array


def crossing_at(
    every: Array, usable: NDArray[np.bool_], track: Array, branch: int, end: int, step_max: float
) -> Crossing | None:
    """The crossing because of which a track [.., 6] of this branch ends before sample `end`.

    every [k, 8, 6] and usable [k, 8]: all branches, and where their angles are defined. None: no other branch goes on
    with steps like those before and after, or several do.
    """
    before = np.flatnonzero(usable[:end, branch])
    after = np.flatnonzero(usable[end:].any(axis=1))
    if not before.size or not after.size:
        return None
    a, c = int(before[-1]), end + int(after[0])
    # Two samples on either side, the nearest ones, as far as there are any and they are defined.
    left = track[[a]] if a == 0 or not usable[a - 1, branch] else track[a - 1 : a + 1]
    found: list[tuple[int, Array]] = []
    for other in np.flatnonzero(usable[c]).tolist():
        step = wrapped(every[c, other] - track[a])
        right = (track[a] + step)[None]
        if c + 1 < len(every) and usable[c + 1, other]:
            right = np.stack([right[0], right[0] + wrapped(every[c + 1, other] - every[c, other])])
        if other != branch and np.abs(step).max() <= step_max * (c - a) and _smooth(left, right, c - a):
            found.append((other, right))
    if not found or any(np.abs(right[0] - found[0][1][0]).max() > _SAME for _, right in found):
        return None
    other, right = found[0]
    return Crossing(a, c, other, _between(left, right, c - a))


def _smooth(left: Array, right: Array, gap: int) -> bool:
    """The steps across go on from those before and into those after, whichever are known; at least one must be."""
    across = (right[0] - left[-1]) / gap
    steps = [side[1] - side[0] for side in (left, right) if len(side) == 2]
    widest = [SHARE * max(np.abs(across).max(), np.abs(step).max()) + _ROUNDING for step in steps]
    return bool(steps) and all(np.abs(across - s).max() <= w for s, w in zip(steps, widest, strict=True))


def _between(left: Array, right: Array, gap: int) -> Array:
    """[gap - 1, 6]: the polynomial through the samples on either side (Lagrange)."""
    nodes = np.concatenate((np.arange(1.0 - len(left), 1.0), gap + np.arange(float(len(right)))))
    values = np.concatenate((left, right))
    at = np.arange(1.0, gap)[:, None]
    apart = np.where(np.eye(len(nodes), dtype=np.bool_), 1.0, nodes[:, None] - nodes)
    factors = np.where(np.eye(len(nodes), dtype=np.bool_), 1.0, at[:, :, None] - nodes)
    between: Array = (factors / apart).prod(axis=2) @ values
    return between
