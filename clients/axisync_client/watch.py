"""How often to look at a move that was accepted, and when enough was seen: for every kind of client."""

import time
from collections.abc import Callable

from axisync_client.errors import MoveFailed, MoveHeld, MoveNotDone, MoveStopped, MoveTimedOut
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.replies import MoveReport

ERRORS: dict[MoveStatus, type[MoveNotDone]] = {
    MoveStatus.FAILED: MoveFailed,
    MoveStatus.STOPPED: MoveStopped,
    MoveStatus.HELD: MoveHeld,
    MoveStatus.EXECUTING: MoveNotDone,
}
POLL_S = (0.01, 0.25)
"""Shortest and longest pause between two looks at a move."""


class Watch:
    """One wait for the end of a move."""

    def __init__(
        self, check: Callable[[], None], timeout_s: float | None = None, *, through_held: bool = False
    ) -> None:
        """
        Args:
            check: raises LeaseLost where the move can no longer arrive.
            timeout_s: how long to watch; None: as long as it takes.
            through_held: a held move is not over.
        """
        self._check = check
        self._timeout_s = timeout_s
        self._through_held = through_held
        self._end = None if timeout_s is None else time.monotonic() + timeout_s

    def pause_s(self, report: MoveReport) -> float | None:
        """How long to wait before the next look; None where the move is over.

        Raises:
            MoveTimedOut: still on its way.
            LeaseLost: see `check`.
        """
        if self._over(report):
            return None
        self._check()
        left_s = None if self._end is None else self._end - time.monotonic()
        if left_s is not None and left_s <= 0:
            raise MoveTimedOut(
                f"move {report.move_id} of {report.group} is at {report.progress:.0%} after {self._timeout_s:g} s"
            )
        return _pause_s(report, left_s)

    def _over(self, report: MoveReport) -> bool:
        if report.status is MoveStatus.HELD:
            return not self._through_held
        return report.status is not MoveStatus.EXECUTING


def arrived(report: MoveReport) -> MoveReport:
    """The report of a move that must have arrived.

    Raises:
        MoveStopped, MoveFailed, MoveHeld: it has not.
    """
    if report.status is not MoveStatus.SUCCEEDED:
        raise ERRORS[report.status](report)
    return report


def _pause_s(report: MoveReport, left_s: float | None) -> float:
    """Half of what the move still takes at full rate: few looks at first, quick ones at the end."""
    shortest, longest = POLL_S
    pause = min(longest, max(shortest, 0.5 * (1.0 - report.progress) * report.duration_s))
    return pause if left_s is None else min(pause, left_s)
