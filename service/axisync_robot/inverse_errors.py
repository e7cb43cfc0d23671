"""Why an arm cannot follow a path of poses: each refusal says at which sample, and with which numbers."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class PathRefused(ValueError):
    """The arm cannot follow. Attribute: `sample` (index of the pose that it cannot go on to)."""

    sample: int


class Unreachable(PathRefused):
    """No configuration puts the tool there.

    Attributes: `distance` (m to the nearest reachable position), `nearest` ([4, 4], that pose, in O), `turn` (rad
    between the orientations; 0 where the nearest keeps the one asked for).
    """

    def __init__(self, sample: int, distance: float, nearest: Array, turn: float = 0.0) -> None:
        self.sample, self.distance, self.nearest, self.turn = sample, distance, nearest, turn
        super().__init__(sample, distance, nearest, turn)

    def __str__(self) -> str:
        turned = f" and {self.turn:.3g} rad of turn" if self.turn else ""
        x, y, z = self.nearest[:3, 3].tolist()
        return (
            f"pose {self.sample} is out of reach by {self.distance:.4g} m{turned}; "
            f"the nearest reachable position is {x:.6g}, {y:.6g}, {z:.6g} m"
        )


class BranchChange(PathRefused):
    """The path goes on only in another configuration of shoulder, elbow or wrist.

    Attributes: `branch`, `other` (0 to 7), `step` (largest joint step onto the other branch, rad).
    """

    def __init__(self, sample: int, branch: int, other: int, step: float) -> None:
        self.sample, self.branch, self.other, self.step = sample, branch, other, step
        super().__init__(sample, branch, other, step)

    @property
    def where(self) -> str:
        """Which of them would have to change: "elbow", "shoulder and wrist"."""
        return " and ".join(
            name for bit, name in ((4, "shoulder"), (2, "elbow"), (1, "wrist")) if (self.branch ^ self.other) & bit
        )

    def __str__(self) -> str:
        return f"pose {self.sample} needs the other {self.where} (branch {self.branch} to {self.other})"


class Singular(PathRefused):
    """A joint would have to jump: the path passes a singularity.

    Attributes: `joint` (index), `step` (rad from the sample before), `bound` (rad), `where` (shoulder, elbow, wrist or
    arm).
    """

    def __init__(self, sample: int, joint: int, step: float, bound: float, where: str) -> None:
        self.sample, self.joint, self.step, self.bound, self.where = sample, joint, step, bound, where
        super().__init__(sample, joint, step, bound, where)

    def __str__(self) -> str:
        return (
            f"pose {self.sample} is past a {self.where} singularity: joint {self.joint + 1} would step by "
            f"{self.step:.4g} rad, at most {self.bound:.4g} rad is allowed"
        )


class LimitReached(PathRefused):
    """A joint would leave its limits. Attributes: `joint` (index), `value` and `bound` (rad)."""

    def __init__(self, sample: int, joint: int, value: float, bound: float) -> None:
        self.sample, self.joint, self.value, self.bound = sample, joint, value, bound
        super().__init__(sample, joint, value, bound)

    def __str__(self) -> str:
        return (
            f"pose {self.sample} needs joint {self.joint + 1} at {self.value:.6g} rad, beyond its limit "
            f"{self.bound:.6g} rad"
        )


class StartsElsewhere(PathRefused):
    """The start configuration does not stand at the first pose.

    Attributes: `distance` (m), `turn` (rad), `bound` (of either).
    """

    def __init__(self, distance: float, turn: float, bound: float) -> None:
        self.sample, self.distance, self.turn, self.bound = 0, distance, turn, bound
        super().__init__(distance, turn, bound)

    def __str__(self) -> str:
        return (
            f"the start configuration is {self.distance:.4g} m and {self.turn:.4g} rad from the first pose, at most "
            f"{self.bound:g} of either is allowed"
        )
