"""A move that was accepted, from here to its end."""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from axisync_client.watch import Watch, arrived
from axisync_schemas.replies import GroupReply, MoveReply, MoveReport

if TYPE_CHECKING:
    from axisync_client.client import Client
    from axisync_client.lease import Lease


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
        self._check = lease.check

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
            LeaseLost: the move comes to `held`, or goes on for whoever took the lease.
            Unavailable: the daemon is gone.
        """
        watch = Watch(self._check, timeout_s, through_held=through_held)
        while (pause_s := watch.pause_s(report := self.report())) is not None:
            time.sleep(pause_s)
        return report

    def result(self, timeout_s: float | None = None) -> MoveReport:
        """As `wait`, for a move that must arrive.

        Raises:
            MoveStopped, MoveFailed, MoveHeld: it did not.
        """
        return arrived(self.wait(timeout_s))

    def updates(self, period_s: float = 0.05) -> Iterator[MoveReport]:
        """Reports for a progress display, the last one that of the end (or of a held move)."""
        watch = Watch(self._check)
        while True:
            report = self.report()
            yield report
            if watch.pause_s(report) is None:
                return
            time.sleep(period_s)

    def stop(self) -> GroupReply:
        """Stops the group on its path; ends the move."""
        return self._client.stop(self.group)
