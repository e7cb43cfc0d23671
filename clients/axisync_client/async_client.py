"""`Client` for asyncio: the same names, arguments, results and errors, awaited."""

import asyncio
from collections.abc import Generator, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from axisync_client.async_lease import AsyncLease, AsyncOnLost
from axisync_client.async_stream import AsyncStream
from axisync_client.client import Client
from axisync_client.errors import LeaseLost, Unavailable
from axisync_client.lease import Lease
from axisync_client.setpoints import Setpoints
from axisync_client.threads import Opening, Shadow, asynchronous, in_thread
from axisync_schemas.replies import Event, State


class AsyncClient(Shadow[Client]):
    """Connects when awaited or entered.

        async with AsyncClient() as client, client.lease("kingkong") as arm:
            await arm.enable()
            move = await arm.move_joint(deg(-90, 60, -45, 0, 0, 0))
            await move.result()

    Every call may be cancelled: it then returns at once. A command that was under way may still be carried out; a
    lease that was, is given back.
    """

    def __init__(
        self, endpoint: str | None = None, *, cell: str | None = None, user: str | None = None, timeout_s: float = 5.0
    ) -> None:
        """Arguments as of `Client`; errors come when it connects."""
        self._connect = lambda: Client(endpoint, cell=cell, user=user, timeout_s=timeout_s)
        self._client: Client | None = None

    @property
    def _blocking(self) -> Client:  # type: ignore[override]  # there only after connecting
        if self._client is None:
            raise Unavailable("the client is not connected", "use `async with AsyncClient() as client`, or await it")
        return self._client

    def __await__(self) -> Generator[Any, None, Self]:
        return self._connected().__await__()

    async def _connected(self) -> Self:
        if self._client is None:
            self._client = await in_thread(self._connect, undo=Client.close)
        return self

    @property
    def endpoint(self) -> str:
        """Where the daemon is."""
        return self._blocking.endpoint

    @property
    def cell(self) -> str:
        """Which cell it is."""
        return self._blocking.cell

    @property
    def user(self) -> str:
        """Who asks."""
        return self._blocking.user

    @property
    def timeout_s(self) -> float:
        """For every question that has no longer one of its own."""
        return self._blocking.timeout_s

    info = asynchronous(Client.info)
    config = asynchronous(Client.config)
    state = asynchronous(Client.state)
    move_report = asynchronous(Client.move_report)
    recent_events = asynchronous(Client.recent_events)
    stop = asynchronous(Client.stop)
    plan = asynchronous(Client.plan)
    plan_joint = asynchronous(Client.plan_joint)
    plan_linear = asynchronous(Client.plan_linear)
    plan_circular = asynchronous(Client.plan_circular)
    plan_path = asynchronous(Client.plan_path)
    plan_sequence = asynchronous(Client.plan_sequence)
    plan_program = asynchronous(Client.plan_program)

    def lease(
        self,
        groups: str | Sequence[str],
        ttl_s: float = 2.0,
        *,
        take: bool = False,
        on_lost: AsyncOnLost | None = None,
    ) -> Opening[AsyncLease]:
        """As `Client.lease`: `await` it, or use it by `async with`.

        Args:
            on_lost: called once, in the event loop.
        """

        async def acquire() -> AsyncLease:
            loop = asyncio.get_running_loop()

            def lost(lease: Lease, error: LeaseLost) -> None:
                if on_lost is not None:
                    with suppress(RuntimeError):  # the loop is closed: nobody is there to be told
                        loop.call_soon_threadsafe(on_lost, AsyncLease(lease), error)

            blocking = self._blocking
            return AsyncLease(
                await in_thread(lambda: blocking.lease(groups, ttl_s, take=take, on_lost=lost), undo=Lease.release)
            )

        return Opening(acquire)

    def events(self) -> AsyncStream[Event]:
        """Events from now on. A long silence is no error as long as the daemon is there."""
        return AsyncStream(self._blocking.events)

    def states(self) -> AsyncStream[State]:
        """States from now on, 20 a second."""
        return AsyncStream(self._blocking.states)

    def setpoints(self) -> AsyncStream[Setpoints]:
        """Every tick of the control cycle from now on, as arrays, about 10 ticks at a time."""
        return AsyncStream(self._blocking.setpoints)

    async def close(self) -> None:
        """Gives leases back and ends the connection. May be called twice; also called when the interpreter ends."""
        if self._client is not None:
            await in_thread(self._client.close)

    async def __aenter__(self) -> Self:
        return await self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()
