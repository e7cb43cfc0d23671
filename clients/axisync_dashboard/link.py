"""The one way to the daemon: a thread that keeps a client connected, readers of its streams, and calls in threads.

Nothing here waits on the page's event loop, and a stop never waits for another call: it has threads of its own.
"""

import asyncio
import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from axisync_client import AxisyncError, Client, Stream, Unavailable
from axisync_client.calls import Call
from axisync_dashboard.telemetry import Telemetry
from axisync_dashboard.words import of_error
from axisync_schemas.base import Strict
from axisync_schemas.replies import GroupReply

T = TypeVar("T")
R = TypeVar("R", bound=Strict)
RETRY_S = 0.5
CONNECT_TIMEOUT_S = 2.0

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Address:
    """Of the daemon, as `Client` takes it."""

    endpoint: str | None = None
    cell: str | None = None
    user: str | None = None


class DaemonLink:
    """Keeps `telemetry` up to date from `start` to `close`; connects again by itself."""

    def __init__(self, address: Address, telemetry: Telemetry) -> None:
        self.telemetry = telemetry
        self._address = address
        self._client: Client | None = None
        self._ending = threading.Event()
        self._broken = threading.Event()
        self._calls = ThreadPoolExecutor(8, "axisync-call")
        self._stops = ThreadPoolExecutor(2, "axisync-stop")
        self._keeper = threading.Thread(target=self._keep, name="axisync-keeper", daemon=True)

    def start(self) -> None:
        """Begins to look for the daemon."""
        self._keeper.start()

    def close(self) -> None:
        """Gives leases back and ends the connection. May be called twice."""
        self._ending.set()
        self._broken.set()
        if self._keeper.is_alive():
            self._keeper.join(5.0)
        self._calls.shutdown(wait=False, cancel_futures=True)
        self._stops.shutdown(wait=False, cancel_futures=True)

    @property
    def client(self) -> Client:
        """The connected client.

        Raises:
            Unavailable: there is none just now.
        """
        if self._client is None:
            raise Unavailable(self.telemetry.trouble.rstrip(".") or "no connection to the daemon")
        return self._client

    async def call(self, ask: Callable[[Client], T]) -> T:
        """What `ask` returns, from a thread.

        Raises:
            AxisyncError: as `ask` does, or nobody is there.
        """
        return await asyncio.get_running_loop().run_in_executor(self._calls, lambda: ask(self.client))

    async def ask(self, call: Call[R]) -> R:
        """The answer to a command that the client has no method for.

        Raises:
            AxisyncError: refused, or nobody is there.
        """
        return await self.call(lambda client: client._ask(call))

    def in_background(self, work: Callable[[], object]) -> None:
        """Runs it in a thread; nobody waits for it."""

        def run() -> None:
            try:
                work()
            except AxisyncError as error:
                _log.info("background=failed reason=%s", error)  # it lapses by itself

        self._calls.submit(run)

    async def stop(self, group: str = "all") -> GroupReply:
        """Stops a group, or all, on their paths; needs no lease.

        Raises:
            AxisyncError: nobody took the stop.
        """
        return await asyncio.get_running_loop().run_in_executor(self._stops, lambda: self.client.stop(group))

    # The keeper's thread.

    def _keep(self) -> None:
        while not self._ending.is_set():
            try:
                self._session()
            except AxisyncError as error:
                self.telemetry.lost(of_error(error))
            self._ending.wait(RETRY_S)

    def _session(self) -> None:
        """From connecting to the loss of the daemon.

        Raises:
            AxisyncError: it is not there.
        """
        address = self._address
        with Client(address.endpoint, cell=address.cell, user=address.user, timeout_s=CONNECT_TIMEOUT_S) as client:
            self.telemetry.connected(client.config(), client.info(), client.state())
            self._client = client
            self._broken.clear()
            try:
                self._read(client)
                self._broken.wait()
            finally:
                self._client = None
                self.telemetry.trouble = self.telemetry.trouble or "The connection to the daemon ended."

    def _read(self, client: Client) -> None:
        """A thread for each stream."""
        telemetry = self.telemetry
        self._reader(client.states(), telemetry.on_state)
        self._reader(client.setpoints(), telemetry.on_setpoints)
        self._reader(client.events(), telemetry.on_event)

    def _reader(self, stream: Stream[T], sink: Callable[[T], None]) -> None:
        def run() -> None:
            try:
                for message in stream:
                    sink(message)
            except AxisyncError as error:
                self.telemetry.lost(of_error(error))
            except Exception:
                # A message that no view can take must not end the view quietly: connect again, and say so.
                _log.exception("reader=failed")
                self.telemetry.lost("What the daemon sent cannot be shown.")
            self._broken.set()

        threading.Thread(target=run, name="axisync-reader", daemon=True).start()
