"""One step of a move, planned: what every kind of move comes to."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisync_motion.trajectory import Trajectory

Array = NDArray[np.float64]
Contacts = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A synchronised motion of the group's axes; at rest at both ends.

    Attributes:
        trajectory: None where nothing moves.
        end: [n] where it ends, rad.
        scalars: names of what MASA synchronised, the rows of T and U; `minimum` [m] is each one's own shortest time.
        limiting: what sets the duration: a scalar, or the joint for whose limits it was stretched by `scale`.
    """

    kind: str
    trajectory: Trajectory | None
    end: Array
    scalars: tuple[str, ...] = ()
    T: Array = field(default_factory=lambda: np.zeros((0, 7)))
    U: Array = field(default_factory=lambda: np.zeros((0, 7)))
    minimum: Array = field(default_factory=lambda: np.zeros(0))
    limiting: str | None = None
    scale: float = 1.0
    contacts: Contacts = ()

    @property
    def duration(self) -> float:
        """s."""
        return 0.0 if self.trajectory is None else self.trajectory.duration
