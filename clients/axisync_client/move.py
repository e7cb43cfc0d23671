"""A move that was accepted, from here to its end."""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from axisync_client.errors import MoveFailed, MoveHeld, MoveNotDone, MoveStopped, MoveTimedOut
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.replies import GroupReply, MoveReply, MoveReport

if TYPE_CHECKING:
    from axisync_client.client import Client
    from axisync_client.lease import Lease

ERRORS: dict[MoveStatus, type[MoveNotDone]] = {
    MoveStatus.FAILED: MoveFailed,
    MoveStatus.STOPPED: MoveStopped,
    MoveStatus.HELD: MoveHeld,
    MoveStatus.EXECUTING: MoveNotDone,
}
POLL_S = (0.01, 0.25)
"""Shortest and longest pause between two looks at a move."""


class Move:
    """Made by `Lease.move` and its kin.

    Attributes:
        reply: the plan: duration, segment times, limiting axis.
        id: the daemon's name for the move.
        group: what moves.
    """

    def __init__(self, client: "Client", reply: MoveReply, lease: "Lease") -> None:
        self.reply = reply
        self.id = reply.move_id or ""
        self.group = reply.group
        self._client = client
        self._lease = lease

    def report(self) -> MoveReport:
        """Where the move is now."""
        return self._client.move_report(self.id)

    def progress(self) -> float:
        """Share of the path that lies behind, 0 to 1."""
        return self.report().progress

    def wait(self, timeout_s: float | None = None, *, through_held: bool = False) -> MoveReport:
        """The report once the move has ended, in whatever way; `result` raises unless it arrived.

        Args:
            timeout_s: how long to wait; None: as long as it takes and the daemon answers.
            through_held: a held move counts as ended, since only a resume moves it on; with this it does not.

        Raises:
            MoveTimedOut: still on its way.
            LeaseLost: the move goes on to `held` without us.
            Unavailable: the daemon is gone.
        """
        end = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            report = self.report()
            if _over(report, through_held):
                return report
            self._lease.check()
            left_s = None if end is None else end - time.monotonic()
            if left_s is not None and left_s <= 0:
                raise MoveTimedOut(f"move {self.id} of {self.group} is at {report.progress:.0%} after {timeout_s:g} s")
            time.sleep(_pause_s(report, left_s))

    def result(self, timeout_s: float | None = None) -> MoveReport:
        """As `wait`, for a move that must arrive.

        Raises:
            MoveStopped, MoveFailed, MoveHeld: it did not.
        """
        report = self.wait(timeout_s)
        if report.status is not MoveStatus.SUCCEEDED:
            raise ERRORS[report.status](report)
        return report

    def updates(self, period_s: float = 0.05) -> Iterator[MoveReport]:
        """Reports for a progress display, the last one that of the end (or of a held move)."""
        while True:
            report = self.report()
            yield report
            if _over(report, through_held=False):
                return
            self._lease.check()
            time.sleep(period_s)

    def stop(self) -> GroupReply:
        """Stops the group on its path; ends the move."""
        return self._client.stop(self.group)


def _over(report: MoveReport, through_held: bool) -> bool:
    if report.status is MoveStatus.HELD:
        return not through_held
    return report.status is not MoveStatus.EXECUTING


def _pause_s(report: MoveReport, left_s: float | None) -> float:
    """Half of what the move still takes at full rate: few looks at first, quick ones at the end."""
    shortest, longest = POLL_S
    pause = min(longest, max(shortest, 0.5 * (1.0 - report.progress) * report.duration_s))
    return pause if left_s is None else min(pause, left_s)
