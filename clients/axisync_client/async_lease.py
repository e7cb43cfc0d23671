"""`Lease` and `Move` for asyncio."""

import asyncio
import functools
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, Self

from axisync_client.errors import LeaseLost, Refused
from axisync_client.jog import Jog, Space
from axisync_client.lease import Lease
from axisync_client.move import Move
from axisync_client.threads import Shadow, asynchronous, in_thread
from axisync_client.units import Floats
from axisync_client.watch import Watch, arrived
from axisync_schemas.replies import JogReply, MoveReply, MoveReport

P = ParamSpec("P")
JOG_CHECK_S = 0.05
"""How soon a jog that has ended by itself is noticed."""


class AsyncMove(Shadow[Move]):
    """`Move`, awaited. Made by `AsyncLease.move` and its kin."""

    def __init__(self, blocking: Move) -> None:
        self._blocking = blocking
        self._check = blocking._check

    @property
    def reply(self) -> MoveReply:
        """The plan: duration, segment times, limiting axis."""
        return self._blocking.reply

    @property
    def id(self) -> str:
        """The daemon's name for the move."""
        return self._blocking.id

    @property
    def group(self) -> str:
        """What moves."""
        return self._blocking.group

    report = asynchronous(Move.report)
    progress = asynchronous(Move.progress)
    stop = asynchronous(Move.stop)

    async def wait(self, timeout_s: float | None = None, *, through_held: bool = False) -> MoveReport:
        """As `Move.wait`. Cancelling it leaves the move alone."""
        watch = Watch(self._check, timeout_s, through_held=through_held)
        while (pause_s := watch.pause_s(report := await self.report())) is not None:
            await asyncio.sleep(pause_s)
        return report

    async def result(self, timeout_s: float | None = None) -> MoveReport:
        """As `Move.result`."""
        return arrived(await self.wait(timeout_s))

    async def updates(self, period_s: float = 0.05) -> AsyncIterator[MoveReport]:
        """As `Move.updates`."""
        watch = Watch(self._check)
        while True:
            report = await self.report()
            yield report
            if watch.pause_s(report) is None:
                return
            await asyncio.sleep(period_s)


def _starting(
    method: Callable[Concatenate[Lease, P], Move],
) -> Callable[Concatenate["AsyncLease", P], Coroutine[Any, Any, AsyncMove]]:
    @functools.wraps(method)
    async def call(self: "AsyncLease", /, *args: P.args, **kwargs: P.kwargs) -> AsyncMove:
        blocking = self._blocking
        return AsyncMove(await in_thread(lambda: method(blocking, *args, **kwargs)))

    return call


class AsyncJog(Shadow[Jog]):
    """`Jog` for `async with`. Made by `AsyncLease.jog`. A busy event loop does not end it: a thread asks again."""

    def __init__(self, blocking: Jog) -> None:
        self._blocking = blocking

    @property
    def reply(self) -> JogReply | None:
        """The newest; `reply.ahead` says what is in force and what the way ends at."""
        return self._blocking.reply

    @property
    def blocked(self) -> Refused | None:
        """Why it does not move now although it is asked to; None while it does."""
        return self._blocking.blocked

    @property
    def velocity(self) -> tuple[float, ...]:
        """As `Jog.velocity`."""
        return self._blocking.velocity

    @velocity.setter
    def velocity(self, velocity: Floats) -> None:
        self._blocking.velocity = velocity

    def check(self) -> None:
        """As `Jog.check`."""
        self._blocking.check()

    async def sleep(self, seconds: float) -> None:
        """As `Jog.sleep`."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self.check()
            await asyncio.sleep(min(left_s, JOG_CHECK_S))
        self.check()

    async def __aenter__(self) -> Self:
        """As `Jog.__enter__`."""
        await in_thread(self._blocking.__enter__, lambda jog: jog.__exit__(None, None, None))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """As `Jog.__exit__`."""
        await in_thread(lambda: self._blocking.__exit__(kind, error, trace))


class AsyncLease(Shadow[Lease]):
    """`Lease`, awaited. Made by `AsyncClient.lease`. Renewed on a thread, so a busy event loop does not lose it.

    A command that is cancelled while it is under way may still be carried out.
    """

    def __init__(self, blocking: Lease) -> None:
        self._blocking = blocking

    @property
    def groups(self) -> tuple[str, ...]:
        """Names as they were asked for."""
        return self._blocking.groups

    @property
    def ttl_s(self) -> float:
        """How long the daemon waits for a sign of life."""
        return self._blocking.ttl_s

    @property
    def token(self) -> str:
        """Proof of the lease, sent with every command."""
        return self._blocking.token

    @property
    def epoch(self) -> int:
        """Grows whenever a group changes hands."""
        return self._blocking.epoch

    @property
    def lost(self) -> bool:
        """True once the lease is no longer ours without having been released."""
        return self._blocking.lost

    def check(self) -> None:
        """Does nothing while the lease is ours.

        Raises:
            LeaseLost: it is no longer.
        """
        self._blocking.check()

    enable = asynchronous(Lease.enable)
    disable = asynchronous(Lease.disable)
    reset = asynchronous(Lease.reset)
    hold = asynchronous(Lease.hold)
    resume = asynchronous(Lease.resume)
    override = asynchronous(Lease.override)
    home = asynchronous(Lease.home)
    stop = asynchronous(Lease.stop)
    release = asynchronous(Lease.release)

    move = _starting(Lease.move)
    move_joint = _starting(Lease.move_joint)
    move_linear = _starting(Lease.move_linear)
    move_circular = _starting(Lease.move_circular)
    move_path = _starting(Lease.move_path)
    move_sequence = _starting(Lease.move_sequence)
    run_program = _starting(Lease.run_program)

    def jog(
        self, group: str | None = None, *, space: Space = "joint", velocity: Floats, ttl_s: float = 0.2
    ) -> AsyncJog:
        """As `Lease.jog`, for `async with`."""
        return AsyncJog(self._blocking.jog(group, space=space, velocity=velocity, ttl_s=ttl_s))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """As `Lease.__exit__`: releases, and raises a loss that nobody has noticed yet."""
        await in_thread(lambda: self._blocking.__exit__(kind, error, trace))


AsyncOnLost = Callable[[AsyncLease, LeaseLost], None]
