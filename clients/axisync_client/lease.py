"""The right to move some groups: acquired, renewed in the background, lost loudly, released on the way out."""

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar, Unpack

from axisync_client import calls, moves
from axisync_client.calls import Call
from axisync_client.errors import AxisyncError, InvalidArgument, LeaseLost, Refused
from axisync_client.jog import Jog, Space
from axisync_client.move import Move
from axisync_client.moves import AnyMove, JointOptions, LinearOptions, PathOptions, Place
from axisync_client.program import load
from axisync_client.renewal import Renewal
from axisync_client.units import Floats
from axisync_schemas.base import Strict
from axisync_schemas.errors import ErrorCode
from axisync_schemas.moves import Curve, Dwell, SingleMove
from axisync_schemas.programs import Program
from axisync_schemas.replies import GroupReply, LeaseReply

if TYPE_CHECKING:
    from axisync_client.client import Client

R = TypeVar("R", bound=Strict)
OnLost = Callable[["Lease", LeaseLost], None]
NOT_OURS = frozenset({ErrorCode.LEASE_FENCED, ErrorCode.LEASE_REQUIRED})
RELEASE_TIMEOUT_S = 0.5

_log = logging.getLogger(__name__)


class Lease:
    """Made by `Client.lease`. A context manager: leaving the block gives the lease back.

    What still moves when the lease ends comes to `held` on its path, so wait for a move before leaving the block.

    Attributes:
        groups: names as they were asked for.
        token: proof of the lease, sent with every command.
        epoch: grows whenever a group changes hands.
        lost: somebody took it, it lapsed, or the daemon forgot it. From then on every use raises `LeaseLost`.
    """

    def __init__(
        self,
        client: "Client",
        groups: tuple[str, ...],
        ttl_s: float,
        reply: LeaseReply,
        sent_s: float,
        on_lost: OnLost | None,
    ) -> None:
        self.groups = groups
        self.ttl_s = ttl_s
        self.token = reply.lease
        self.epoch = reply.epoch
        self._client = client
        self._on_lost = on_lost
        self._lock = Lock()
        self._loss: LeaseLost | None = None
        self._released = False
        self._renewal = Renewal(ttl_s, sent_s + reply.expires_in_s, self._renew, self._lose)

    @property
    def lost(self) -> bool:
        """True once the lease is no longer ours without having been released."""
        return self._loss is not None

    def check(self) -> None:
        """Does nothing while the lease is ours.

        Raises:
            LeaseLost: it is no longer.
        """
        if self._loss is not None:
            raise LeaseLost(self._loss.message, self._loss.fix)
        if self._released:
            raise LeaseLost(f"the lease on {self._names()} was given back", "acquire it again")

    def enable(self, group: str | None = None) -> GroupReply:
        """Switches the group's drives on; returns when they hold their positions."""
        return self._command(calls.group_command("enable", self._group(group), self.token))

    def disable(self, group: str | None = None) -> GroupReply:
        """Switches the group's drives off."""
        return self._command(calls.group_command("disable", self._group(group), self.token))

    def reset(self, group: str | None = None) -> GroupReply:
        """Acknowledges faults; the group is disabled afterwards."""
        return self._command(calls.group_command("reset", self._group(group), self.token))

    def hold(self, group: str | None = None) -> GroupReply:
        """Brings what moves to rest on its path; answered when that has begun. `resume` goes on."""
        return self._command(calls.group_command("hold", self._group(group), self.token))

    def resume(self, group: str | None = None) -> GroupReply:
        """Goes on with a move that is held, or slowing to be held."""
        return self._command(calls.group_command("resume", self._group(group), self.token))

    def override(self, value: float, group: str | None = None) -> GroupReply:
        """Runs along paths at `value` (0..1) of their speed, from now on and in later moves, until it is changed."""
        return self._command(calls.override(self._group(group), value, self.token))

    def home(self, group: str | None = None) -> GroupReply:
        """Has the drives of an enabled group find their homes. They move by themselves, and nothing checks for
        collisions. Returns when all axes are homed.

        Raises:
            Refused: with NOT_ENABLED, BUSY, or the reason for which home was not found.
        """
        name = self._group(group)
        return self._command(calls.home(self._client.config(), name, self.token))

    def move(self, move: AnyMove, *, group: str | None = None, speed_scale: float = 1.0) -> Move:
        """Starts any move of `axisync_client.moves`. Returns when it is accepted.

        Args:
            group: needed only where the lease is on several groups.
            speed_scale: s in (0, 1] means the limits V s, A s^2, J s^3.

        Raises:
            Refused: with code, values and, where there is one, a fix.
            LeaseLost: no longer ours.
        """
        call = calls.move(self._group(group), move, speed_scale, self.token)
        return Move(self._client, self._command(call), self)

    def move_joint(
        self, target: Place, *, group: str | None = None, speed_scale: float = 1.0, **options: Unpack[JointOptions]
    ) -> Move:
        """Starts a move in which all axes arrive at one time: `move` of `moves.joint`.

        Args:
            target: rad, one for each axis of the group (`deg(...)` makes radians of degrees), or a `pose`.
        """
        return self.move(moves.joint(target, **options), group=group, speed_scale=speed_scale)

    def move_linear(
        self,
        target: Place | Mapping[str, Place],
        *,
        group: str | None = None,
        speed_scale: float = 1.0,
        **options: Unpack[LinearOptions],
    ) -> Move:
        """Starts a straight line of the tool: `move` of `moves.linear`.

        Args:
            target: x, y, z in m or a `pose`; of a compound group a mapping, member to target.
        """
        return self.move(moves.linear(target, **options), group=group, speed_scale=speed_scale)

    def move_circular(
        self,
        via: Place,
        target: Place,
        *,
        group: str | None = None,
        speed_scale: float = 1.0,
        **options: Unpack[PathOptions],
    ) -> Move:
        """Starts an arc of the tool through `via` to `target`: `move` of `moves.circular`."""
        return self.move(moves.circular(via, target, **options), group=group, speed_scale=speed_scale)

    def move_path(
        self, curve: Curve, *, group: str | None = None, speed_scale: float = 1.0, **options: Unpack[PathOptions]
    ) -> Move:
        """Starts a move along a `Circle` or a `Lissajous`: `move` of `moves.path`."""
        return self.move(moves.path(curve, **options), group=group, speed_scale=speed_scale)

    def move_sequence(
        self, steps: Sequence[SingleMove | Dwell], *, group: str | None = None, speed_scale: float = 1.0
    ) -> Move:
        """Starts steps one after the other, admitted whole: `move` of `moves.sequence`."""
        return self.move(moves.sequence(steps), group=group, speed_scale=speed_scale)

    def run_program(self, program: Program | str | Path, *, speed_scale: float = 1.0) -> Move:
        """Starts a program, or the program of a file, for the group that it names.

        Args:
            speed_scale: a share of the program's own.
        """
        loaded = load(program)
        return self.move(loaded.move, group=loaded.group, speed_scale=loaded.speed_scale * speed_scale)

    def jog(self, group: str | None = None, *, space: Space = "joint", velocity: Floats, ttl_s: float = 0.2) -> Jog:
        """Moves a group for the length of a `with` block: `axisync_client.jog.Jog`.

        Args:
            group: needed only where the lease is on several groups.
            space: joint: one velocity for each axis. tool, base, body: the tool along and about x, y, z of that frame.
            velocity: rad/s; or three values in m/s, and three more in rad/s where it also turns.
            ttl_s: the group stops when the daemon hears nothing for so long.
        """
        return Jog(self._command, self.token, self._group(group), space, velocity, ttl_s)

    def stop(self, group: str | None = None) -> GroupReply:
        """Stops the lease's groups, or one of them, on their paths. Works with a lost lease, too."""
        names = self.groups if group is None else (group,)
        replies = [self._client.stop(name) for name in names]
        return replies[-1].model_copy(update={"groups": {k: v for reply in replies for k, v in reply.groups.items()}})

    def release(self) -> None:
        """Gives the lease back; without effect where it is lost or given back already.

        Raises:
            Unavailable: the daemon did not answer; the lease lapses at its time.
        """
        with self._lock:
            over, self._released = self._released or self.lost, True
        self._renewal.stop()
        self._client._forget(self)
        if not over:
            self._client._ask(calls.release(self.groups, self.token, RELEASE_TIMEOUT_S))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Releases. A loss that nobody has noticed yet is raised here, unless another error is on its way out."""
        try:
            self.release()
        except AxisyncError as failure:
            # Lapses by itself. The error on its way out, if any, says more.
            _log.warning("lease not released groups=%s reason=%s", self._names(), failure)
        if kind is None and self._loss is not None:
            raise self._loss

    def _names(self) -> str:
        return ", ".join(self.groups)

    def _group(self, group: str | None) -> str:
        if group is not None:
            return group
        if len(self.groups) > 1:
            raise InvalidArgument(f"the lease is on {self._names()}", "say which one is meant by group=")
        return self.groups[0]

    def _command(self, call: Call[R]) -> R:
        self.check()
        try:
            return self._client._ask(call)
        except Refused as refusal:
            if refusal.code not in NOT_OURS:
                raise
            self._lose(refusal)
            self.check()
            raise

    def _renew(self, timeout_s: float) -> float:
        sent_s = time.monotonic()
        reply = self._client._ask(calls.renew(self.groups, self.ttl_s, self.token, timeout_s))
        return sent_s + reply.expires_in_s

    def _lose(self, cause: AxisyncError) -> None:
        """Called by the renewal's thread, or where a command is refused; tells once."""
        with self._lock:
            if self._released or self._loss is not None:
                return
            self._loss = LeaseLost(f"the lease on {self._names()} is lost ({cause.message})", "acquire it again")
        self._renewal.stop()
        _log.warning("lease lost groups=%s reason=%s", self._names(), cause.message)
        if self._on_lost is not None:
            self._on_lost(self, self._loss)
