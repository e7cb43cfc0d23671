"""One elementary group: its state, what its drives are told, and what it still owes an answer to. Pure."""

from dataclasses import dataclass, field
from enum import Enum, auto

from axisync_schemas.enumerations import DriveState, GroupState
from axisync_service.drives.cia402 import Controlword, towards_enabled
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.homing import GroupHoming
from axisync_service.motion_controller.player import Motion

ENABLE_TIMEOUT_NS = 3_000_000_000
RESET_TIMEOUT_NS = 3_000_000_000
"""Long enough for a drive to be brought up anew."""
DISABLE_TIMEOUT_NS = 2_000_000_000
RESET_PULSE_TICKS = 10
"""Fault reset needs a rising edge of controlword bit 7: low and high for this many ticks, in turn."""


class Goal(Enum):
    """What the group's drives are being led to."""

    DISABLED = auto()
    ENABLED = auto()
    RESET = auto()


_TO_ENABLED, _OPERATION_ENABLED = Goal.ENABLED, DriveState.OPERATION_ENABLED
_DISABLED = GroupState.DISABLED
"""Of the enumerations, here once: Python 3.11 takes 0.2 us to look a member up, too long for each drive and tick."""


@dataclass(slots=True)
class GroupMachine:
    """State of one group.

    Attributes:
        first, last: its axes are first <= index < last.
        owed: `ref`s of commands to answer when the goal is reached or missed.
        quick_stop: axes whose drives must ramp down by themselves (controlword quick stop) until they are off.
        hold_until_ns: the target is held until then while the brake opens.
        fault: why the group is, or is about to be, in fault; cleared by reset alone.
        disable_at_rest: the drives are to be disabled as soon as the motion rests.
        override: the rate of its path clock; a compound moves at the lowest of its members'.
    """

    index: int
    name: str
    first: int
    last: int
    drives: list[DriveLink]
    state: GroupState = GroupState.DISABLED
    goal: Goal = Goal.DISABLED
    reason: str | None = None
    motion: Motion | None = None
    homing: GroupHoming | None = None
    owed: list[int] = field(default_factory=list)
    quick_stop: set[int] = field(default_factory=set)
    deadline_ns: int = 0
    hold_until_ns: int = 0
    fault: str | None = None
    disable_at_rest: bool = False
    override: float = 1.0

    @property
    def axes(self) -> slice:
        """Its axes."""
        return slice(self.first, self.last)

    @property
    def ready(self) -> bool:
        """Every drive is brought up and has sent its position."""
        return all(drive.bring_up.ready and drive.known for drive in self.drives)

    @property
    def following(self) -> bool:
        """Its drives are enabled, so that its setpoints mean something."""
        return self.goal is _TO_ENABLED

    @property
    def enabling(self) -> bool:
        """On the way from disabled to standstill."""
        return self.state is _DISABLED and self.goal is _TO_ENABLED

    @property
    def all_enabled(self) -> bool:
        """Every drive is in operation enabled."""
        return all(drive.state is DriveState.OPERATION_ENABLED for drive in self.drives)

    @property
    def all_off(self) -> bool:
        """No drive that can be heard holds torque."""
        return not any(
            drive.state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE) for drive in self.drives
        )

    def faulted(self) -> list[str]:
        """Drives in fault, one phrase each."""
        return [
            f"{drive.axis.name} is in {drive.state.label}" + (f" ({drive.emergency.words})" if drive.emergency else "")
            for drive in self.drives
            if drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        ]

    def torque_off(self) -> list[str]:
        """Drives that cannot be enabled since safe torque off is active, one phrase each."""
        return [f"safe torque off of {d.axis.name} is active" for d in self.drives if d.health.torque_is_off]

    def not_homed(self) -> list[str]:
        """Axes that must be homed before they may move."""
        return [drive.axis.name for drive in self.drives if drive.needs_homing]

    def not_ready(self) -> list[str]:
        """Why `enable` cannot work, one sentence a drive."""
        return [
            drive.bring_up.failure or f"axis {drive.axis.name} is still being brought up"
            for drive in self.drives
            if not (drive.bring_up.ready and drive.known)
        ]

    def controlword(self, axis: int, tick: int) -> Controlword:
        """What drive `axis` (0-based within the group) is told in this tick."""
        state, failed = self.drives[axis].state, axis in self.quick_stop
        if failed and state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
            return Controlword.QUICK_STOP
        if self.goal is _TO_ENABLED and not failed:
            command = towards_enabled(state)
            if self.homing is not None and state is _OPERATION_ENABLED:
                return self.homing.controlword(axis) or command
            return command
        if self.goal is Goal.RESET and state is DriveState.FAULT:
            high = tick // RESET_PULSE_TICKS % 2 == 1
            return Controlword.FAULT_RESET if high else Controlword.DISABLE_VOLTAGE
        if state is DriveState.OPERATION_ENABLED:
            return Controlword.SHUTDOWN
        return Controlword.DISABLE_VOLTAGE
