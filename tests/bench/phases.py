"""What the bench has the service do, as a client: swing both arms, start moves, stop moves."""

import random
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from axisync_client import Client, Lease, Move, Refused, deg
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorCode

SWING_DEG, STOPPED_DEG, SHORT_DEG = 15.0, 6.0, 0.5
FAILURES_MAX = 40
"""In a row, without a move that ended well between them."""
AGAIN_S = 0.2
TTL_S = 20.0
"""Of the lease: a machine that is busy with other things for a while ends no soak."""
BUSY_S = 0.005
LEASE_S = 120.0
"""How long the demo's own program may hold the lease."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call of the client, on the monotonic clock, and the move that it is about."""

    move_id: str
    called_ns: int
    answered_ns: int


def acquire(client: Client, group: str) -> Lease:
    """The lease, as soon as the demo's program has given it back.

    Raises:
        Refused: it is still held after LEASE_S.
    """
    end = time.monotonic() + LEASE_S
    while True:
        try:
            return client.lease(group, ttl_s=TTL_S)
        except Refused as refusal:
            if refusal.code != ErrorCode.LEASE_HELD or time.monotonic() > end:
                raise
        time.sleep(0.5)


class Arms:
    """A compound group that moves to and fro around where it was found.

    Attributes:
        failures: why moves failed, drives in fault for example; each time the group was reset and enabled again.
    """

    def __init__(self, client: Client, lease: Lease, group: str) -> None:
        self._client, self._lease, self._group = client, lease, group
        cell = client.config()
        self._axes = len(cell.axis_indices(group))
        self._first = cell.group_names[cell.members(group)[0]]
        self._sign = 1
        self._home = self._setpoint()
        self.failures: list[str] = []
        self._in_a_row = 0

    def of(self, group: str) -> "Arms":
        """The same client and lease for a part of the group."""
        return Arms(self._client, self._lease, group)

    def start(self, degrees: float) -> Move:
        """A relative move of every axis, each time in the other direction."""
        target = np.full(self._axes, self._sign * deg(degrees)[0])
        while True:
            try:
                move = self._lease.move_joint(target, group=self._group, relative=True)
                break
            except Refused as refusal:
                if refusal.code is ErrorCode.BUSY:  # somebody else's plan is being made
                    time.sleep(BUSY_S)
                elif refusal.code in (ErrorCode.FAULTED, ErrorCode.NOT_ENABLED):
                    self._recover(refusal.message)
                else:
                    raise
        self._sign = -self._sign
        return move

    def _setpoint(self) -> float:
        """Of the group's first axis: all of them go the same way."""
        return self._client.state().groups[self._first].setpoint[0]

    def swing(self, seconds: float, meanwhile: Callable[[], object], degrees: float = SWING_DEG) -> tuple[int, int]:
        """Keeps all axes moving for so long; returns begin and end, monotonic ns."""
        begin = time.monotonic_ns()
        while time.monotonic_ns() < begin + seconds * 1e9:
            self._ended(self.start(degrees), MoveStatus.SUCCEEDED)
            meanwhile()
        return begin, time.monotonic_ns()

    def requests(self, count: int) -> list[Call]:
        """Starts and finishes short moves, one at a time; those that succeed."""
        calls: list[Call] = []
        while len(calls) < count:
            called = time.monotonic_ns()
            move = self.start(SHORT_DEG)
            call = Call(move.id, called, time.monotonic_ns())
            if self._ended(move, MoveStatus.SUCCEEDED):
                calls.append(call)
        return calls

    def stops(self, count: int, stop: Callable[[], int] | None = None, seed: int = 1) -> list[Call]:
        """Stops moves in the middle, at instants that are spread over a cycle and over the move.

        Args:
            stop: how, returning when it began, monotonic ns; else as this client. Another way may be slower: its moves
                are longer, and it begins earlier.
        """
        degrees, latest = (STOPPED_DEG, 0.7) if stop is None else (SWING_DEG, 0.4)
        stop = stop or self._stop
        random_share = random.Random(seed)
        calls: list[Call] = []
        while len(calls) < count:
            move = self.start(degrees)
            time.sleep(random_share.uniform(0.2, latest) * move.reply.duration_s)
            called = stop()
            call = Call(move.id, called, time.monotonic_ns())
            if self._ended(move, MoveStatus.STOPPED):
                calls.append(call)
        return calls

    def _stop(self) -> int:
        called = time.monotonic_ns()
        self._client.stop(self._group)
        return called

    def _ended(self, move: Move, expected: MoveStatus) -> bool:
        """Waits; after a failure, has the group ready again.

        Raises:
            RuntimeError: the move ended in a third way.
        """
        report = move.wait()
        if report.status is MoveStatus.FAILED:
            self._recover(report.reason or "no reason")
        elif report.status is not expected:
            raise RuntimeError(f"move {move.id} is {report.status}, should be {expected}: {report.reason}")
        else:
            self._in_a_row = 0
        return report.status is expected

    def _recover(self, reason: str) -> None:
        """Notes the failure; resets and enables the group.

        Raises:
            RuntimeError: failures keep coming.
            Refused: it cannot be enabled again, for another reason than a new fault.
        """
        while True:
            self.failures.append(reason)
            self._in_a_row += 1
            if self._in_a_row > FAILURES_MAX:
                raise RuntimeError(f"{self._in_a_row} failures in a row, the last one: {reason}")
            try:
                self._lease.reset(self._group)
                self._lease.enable(self._group)
                self._sign = 1 if self._setpoint() < self._home else -1
                return
            except Refused as refusal:
                if refusal.code is not ErrorCode.FAULTED:
                    raise
                reason = refusal.message
            time.sleep(AGAIN_S)
