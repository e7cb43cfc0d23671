"""Homing of a group: its drives one after the other, or together; a failure or a stop ends it for all of them. Pure."""

from axisync_service.drives.cia402 import Controlword
from axisync_service.drives.homing import DriveHoming
from axisync_service.drives.link import DriveLink


class GroupHoming:
    """One `home` command at work.

    Attributes:
        ref: of the command to answer.
        failure: why it ended early; None as long as all goes well.
    """

    def __init__(self, ref: int, drives: list[DriveLink], together: bool) -> None:
        self.ref = ref
        self.failure: str | None = None
        self._homings = {i: DriveHoming(drive) for i, drive in enumerate(drives) if drive.axis.drive.homing is not None}
        self._waiting = list(self._homings.values())
        self._active: list[DriveHoming] = []
        self._together = together

    @property
    def done(self) -> bool:
        """Over, one way or the other, and every drive at rest."""
        return not self._waiting and not self._active

    @property
    def stuck(self) -> bool:
        """A drive is not back in csp."""
        return any(homing.stuck for homing in self._homings.values())

    def step(self, now_ns: int) -> list[DriveLink]:
        """One tick on; drives that were homed just now."""
        if self._waiting and (self._together or not self._active):
            count = len(self._waiting) if self._together else 1
            self._active, self._waiting = self._waiting[:count], self._waiting[count:]
        homed = []
        for homing in self._active:
            homing.step(now_ns)
            if homing.done and homing.failure is None:
                homed.append(homing.drive)
            elif homing.failure is not None:
                self.abort(f"{homing.drive.axis.name}: {homing.failure}", now_ns)
        self._active = [homing for homing in self._active if not homing.done]
        return homed

    def abort(self, reason: str, now_ns: int) -> None:
        """Drives that seek their home halt; those whose turn has not come are left alone."""
        self.failure = self.failure or reason
        self._waiting = []
        for homing in self._active:
            homing.abort(reason, now_ns)

    def controlword(self, axis: int) -> Controlword | None:
        """What an enabled drive (0-based within the group) is told, None where homing does not care."""
        homing = self._homings.get(axis)
        return homing.controlword if homing is not None else None

    @property
    def adopting(self) -> list[int]:
        """Axes (0-based within the group) whose setpoint follows the actual position."""
        return [axis for axis, homing in self._homings.items() if homing.adopts]

    def give_up(self) -> None:
        """The group has a fault and is switched off: its drives are led back to csp as well as may be."""
        for homing in self._homings.values():
            homing.give_up()
