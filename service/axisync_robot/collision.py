"""What a cell's arms keep clear of: themselves, each other, the body and the boxes. Frame O, metres, radians."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisync_robot.collision_motion import pair_reach
from axisync_robot.collision_pose import PoseChecker
from axisync_robot.collision_shapes import Shapes
from axisync_robot.collision_sweep import Place, Sweep, first_below, nearest
from axisync_robot.collision_track import Track
from axisync_schemas.cell import Cell

Array = NDArray[np.float64]
Contacts = Sequence[tuple[str, str]]

TOLERANCE, SHARE = 1e-3, 0.05
"""The least distance over a path is found to within 1 mm, or 5 % where that is more; it is one that the path has."""
RESOLUTION = 1e-4
"""A path that keeps the margin by less than this may be refused (two: by less than the tolerance), m.

None that does not keep it passes."""


@dataclass(frozen=True, slots=True)
class Near:
    """Two shapes near each other."""

    distance: float
    """m; negative where they overlap, then it says that, not how deep. Spread, if any, is taken off."""
    pair: tuple[str, str]
    """("kingkong link 3", "wukong link 5"), or a box's name."""
    places: tuple[float, ...] = ()
    """Sample number (2.5: midway) on each path checked, in the order given."""

    def __str__(self) -> str:
        return f"{' / '.join(self.pair)}: {1e3 * self.distance:.1f} mm"


@dataclass(frozen=True, slots=True)
class Check:
    """What is known of a path, or of two against each other."""

    margin: float
    nearest: Near | None
    """The least distance; where shapes overlap, one place where they do. None where nothing is watched."""
    violation: Near | None
    """The first place nearer than `margin` (or not shown to keep it: RESOLUTION); with two paths one of them."""

    @property
    def clear(self) -> bool:
        """The margin is kept everywhere."""
        return self.violation is None

    @property
    def min_distance(self) -> float:
        """m; infinite where nothing is watched."""
        return math.inf if self.nearest is None else self.nearest.distance


class CollisionModel:
    """Shapes and pairs of a cell. Contacts are pairs of axis or box names, as in the cell file's geometry.contacts."""

    def __init__(self, cell: Cell) -> None:
        """Everything that does not depend on a pose."""
        self._cell = cell
        self._shapes = Shapes.of(cell)
        self._reach = pair_reach(self._shapes)
        self._poses = PoseChecker(self._shapes)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All pairs watched, in words."""
        return tuple(self._words(p) for p in range(len(self._shapes.pairs)))

    def clearance(self, q: ArrayLike, contacts: Contacts = ()) -> Near | None:
        """The nearest pair at q[n] (all axes of the cell); None where nothing is watched. By coal.

        Raises:
            ValueError: not n finite angles, or a contact that the cell file does not have.
        """
        pose = self._pose(q)
        skipped = np.flatnonzero(self._excused(contacts)).tolist() if contacts else []
        if len(skipped) == len(self._shapes.pairs):
            return None
        distance, pair = self._poses.nearest(pose, skipped)
        return Near(distance, self._words(pair))

    def check_path(
        self,
        q: ArrayLike,
        margin: float | None = None,
        *,
        group: str = "all",
        rest: ArrayLike | None = None,
        spread: ArrayLike | None = None,
        contacts: Contacts = (),
    ) -> Check:
        """The path q[k, m] of a group, a compound or "all", everything else standing at rest[n].

        Samples are joined by straight lines in joint space. spread[k, m] (or [m]) widens every point to a box of joint
        angles, for what drives do alone. `margin` in m: the cell file's where it is None.

        Raises:
            ValueError: shapes that do not fit, or a contact that the cell file does not have.
            KeyError: no such group.
        """
        return self.check_widened(q, [(margin, spread)], group=group, rest=rest, contacts=contacts)[0]

    def check_widened(
        self,
        q: ArrayLike,
        widened: Sequence[tuple[float | None, ArrayLike | None]],
        *,
        group: str = "all",
        rest: ArrayLike | None = None,
        contacts: Contacts = (),
    ) -> list[Check]:
        """As `check_path` with each of these margins and spreads, in one search: what one of them measures serves all.

        Raises:
            ValueError, KeyError: as `check_path`.
        """
        axes = self._cell.axis_indices(group)
        track = Track.of(axes, q, *(spread for _, spread in widened))
        if rest is None and len(axes) < len(self._cell.axes):
            raise ValueError(f"{group} is not the whole cell: rest says where the other axes are")
        pose = np.zeros(len(self._cell.axes)) if rest is None else self._pose(rest)
        touched = self._moved_by(axes).any(axis=1)
        return self._check([track], pose, touched & ~self._excused(contacts), [margin for margin, _ in widened])

    def check_sweeps(
        self,
        paths: Mapping[str, ArrayLike],
        margin: float | None = None,
        *,
        spreads: Mapping[str, ArrayLike] | None = None,
        contacts: Contacts = (),
    ) -> Check:
        """Two groups' paths {name: q[k, m]} against each other, whole against whole: no clock counts.

        Only pairs between the two; each on its own is `check_path`'s. Its `places` follow the order of `paths`.

        Raises:
            ValueError: not two paths, common axes, shapes that do not fit, or a contact that the file does not have.
            KeyError: no such group.
        """
        if len(paths) != 2:
            raise ValueError(f"two paths are compared, not {len(paths)}")
        axes = [self._cell.axis_indices(name) for name in paths]
        if set(axes[0]) & set(axes[1]):
            raise ValueError(f"{' and '.join(paths)} share axes")
        wide = spreads or {}
        tracks = [Track.of(a, q, wide.get(name)) for a, (name, q) in zip(axes, paths.items(), strict=True)]
        first, second = self._moved_by(axes[0]), self._moved_by(axes[1])
        between = (first[:, 0] & second[:, 1]) | (first[:, 1] & second[:, 0])
        rest = np.zeros(len(self._cell.axes))
        return self._check(tracks, rest, between & ~self._excused(contacts), [margin])[0]

    def _check(
        self, tracks: list[Track], rest: Array, watched: NDArray[np.bool_], margins: Sequence[float | None]
    ) -> list[Check]:
        """By the tracks' spreads, a margin each."""
        keep = [self._cell.geometry.margin if margin is None else margin for margin in margins]
        for margin in keep:
            if not 0.0 <= margin < math.inf:
                raise ValueError(f"margin is {margin:g} m; it must be finite and not negative")
        sweep = Sweep(self._shapes, self._reach, rest, tracks, np.flatnonzero(watched))
        found = nearest(sweep, TOLERANCE, SHARE)
        return [
            Check(margin, self._near(least), self._near(self._violation(sweep, which, margin, least, floor)))
            for which, (margin, (least, floor)) in enumerate(zip(keep, found, strict=True))
        ]

    def _violation(self, sweep: Sweep, which: int, margin: float, least: Place | None, floor: float) -> Place | None:
        """What does not keep the margin, given the nearest place that was found and what nothing falls below."""
        between = len(sweep.tracks) > 1
        if between and least is not None and least.distance < margin:
            return least
        if floor < margin:
            return first_below(sweep, margin, TOLERANCE if between else RESOLUTION, which)
        return None

    def _near(self, place: Place | None) -> Near | None:
        return None if place is None else Near(place.distance, self._words(place.pair), place.places)

    def _words(self, pair: int) -> tuple[str, str]:
        i, j = self._shapes.pairs[pair]
        return self._shapes.words[i], self._shapes.words[j]

    def _moved_by(self, axes: Sequence[int]) -> NDArray[np.bool_]:
        """[p, 2] which shapes of each pair are on links of these axes."""
        moved = np.zeros(len(self._shapes.names), dtype=np.bool_)
        moved[: len(self._shapes.capsules)] = [c.axis in axes for c in self._shapes.capsules]
        return moved[self._shapes.pairs]

    def _excused(self, contacts: Contacts) -> NDArray[np.bool_]:
        """[p] pairs that may touch for now."""
        known = {frozenset(pair) for pair in self._cell.geometry.contacts}
        for pair in contacts:
            if frozenset(pair) not in known:
                raise ValueError(f"the cell file has no contact between {pair[0]} and {pair[1]}")
        return self._shapes.named(contacts)

    def _pose(self, q: ArrayLike) -> Array:
        pose = np.asarray(q, dtype=np.float64)
        if pose.shape != (len(self._cell.axes),) or not np.isfinite(pose).all():
            raise ValueError(f"a pose has {len(self._cell.axes)} finite joint angles, not shape {pose.shape}")
        return pose
