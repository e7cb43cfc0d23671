"""What the actioner knows of the robot at one instant: a snapshot, read from shared memory at the edge."""

from dataclasses import dataclass

from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.internal import ControllerStatus


@dataclass(frozen=True, slots=True)
class GroupView:
    """One elementary group at `World.tick`.

    Attributes:
        plan_id: what it plays, 0 for nothing.
        path_s, path_rate: the path clock: seconds along the plan, and how fast they pass (0..1).
        slot: plan slot that the controller holds, -1 for none.
        reason: why it is held or faulted.
    """

    state: GroupState
    plan_id: int
    path_s: float
    path_rate: float
    slot: int
    reason: str | None


@dataclass(frozen=True, slots=True)
class World:
    """The robot and the service, as of `now_ns` on the monotonic clock.

    Attributes:
        up: the controller is linked and its cycle runs; otherwise every group reads as disabled.
        setpoint, actual, velocity: [axes] rad, rad/s; empty before the first tick.
        status: the controller's last report, or None while it is down.
        unlogged: the log cannot be written at present.
    """

    now_ns: int
    phase: Phase
    up: bool
    tick: int
    setpoint: tuple[float, ...]
    actual: tuple[float, ...]
    velocity: tuple[float, ...]
    groups: tuple[GroupView, ...]
    status: ControllerStatus | None
    unlogged: bool = False

    @property
    def now_s(self) -> float:
        """The clock that clients see."""
        return self.now_ns / 1e9

    def labels(self, names: tuple[str, ...], members: tuple[int, ...]) -> dict[str, str]:
        """States of some groups by name, as on the wire."""
        return {names[i]: self.groups[i].state.label for i in members}
