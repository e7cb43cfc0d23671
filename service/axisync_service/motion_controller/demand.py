"""What a tick decides on, and what it decides: inputs and setpoints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(slots=True)
class Inputs:
    """What one tick decides on.

    Attributes:
        stop_counts, lease_until_ns, lease_epochs: one for each elementary group, from shared memory.
        leases_needed: False when a plan is played from a file, without front.
        front: somebody is connected who answers for the leases.
    """

    tick: int
    now_ns: int
    skipped: int
    stop_counts: list[int]
    lease_until_ns: list[int]
    lease_epochs: list[int]
    front: bool
    leases_needed: bool
    stopping: bool


@dataclass(slots=True)
class Setpoints:
    """Demand of one instant, all axes [n] and all groups [g]; `counts` as the drives' 32-bit objects hold them.

    Attributes:
        rates: [3, n] of which velocity, acceleration and jerk are the rows; rate_bits: the same as they lie in memory.
    """

    position: Array
    rates: Array
    rate_bits: NDArray[np.uint64]
    velocity: Array
    acceleration: Array
    jerk: Array
    plan_id: NDArray[np.uint64]
    path_s: Array
    path_rate: Array
    group_state: NDArray[np.uint32]
    counts: NDArray[np.int32]

    @staticmethod
    def zeros(axes: int, groups: int) -> "Setpoints":
        """Everything at 0."""
        rates = np.zeros((3, axes))
        return Setpoints(
            position=np.zeros(axes),
            rates=rates,
            rate_bits=rates.view(np.uint64),
            velocity=rates[0],
            acceleration=rates[1],
            jerk=rates[2],
            plan_id=np.zeros(groups, np.uint64),
            path_s=np.zeros(groups),
            path_rate=np.zeros(groups),
            group_state=np.zeros(groups, np.uint32),
            counts=np.zeros(axes, np.int32),
        )
