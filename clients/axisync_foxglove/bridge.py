"""From the daemon to Foxglove: a viewer of the one is the server of the other, and outlives its daemon."""

import threading
import time
from collections.abc import Callable
from typing import NoReturn

from axisync_client import AxisyncError, Client
from axisync_foxglove.live_log import LiveLog, Message, offset_ns
from axisync_foxglove.server import FoxgloveServer
from axisync_schemas.cell import Cell

RETRY_S = 0.5
SILENCE_S = 1.0
"""Nothing for so long: ask whether the daemon is there. A controller that is down publishes no ticks."""

Send = Callable[[Message], None]


class Bridge:
    """One run: `serve` until it is interrupted.

    Args:
        connect: a client of the daemon, or AxisyncError where there is none.
        say: takes sentences for whoever started it.
    """

    def __init__(self, connect: Callable[[], Client], host: str, port: int, say: Callable[[str], None]) -> None:
        self._connect, self._say = connect, say
        self._host, self._port = host, port
        self._cell: Cell | None = None
        self._lost = False

    def serve(self) -> NoReturn:
        """Serves until KeyboardInterrupt or SystemExit. A daemon that goes away is waited for.

        Raises:
            AxisyncError: there is no daemon to begin with, or nobody can be served there.
        """
        with self._connect() as client:  # a wrong address is said at once
            name = f"axisync {client.cell}"
        with FoxgloveServer(name, self._host, self._port) as server:
            host = f"[{self._host}]" if ":" in self._host else self._host
            self._say(f"live view: ws://{host}:{server.port} (in Foxglove: Open connection, Foxglove WebSocket)")
            while True:
                try:
                    self._session(server)
                except AxisyncError as error:
                    self._trouble(server, error)
                time.sleep(RETRY_S)

    def _session(self, server: FoxgloveServer) -> None:
        """From connecting to the loss of the daemon.

        Raises:
            AxisyncError: it is not there.
        """
        with self._connect() as client:
            cell, info = client.config(), client.info()
            if cell != self._cell:
                server.offer(cell)
                self._cell = cell
            self._well(server)
            forward(client, LiveLog(cell, offset_ns(info)), server.send)

    def _trouble(self, server: FoxgloveServer, error: AxisyncError) -> None:
        """Said to viewers each time, since they come and go; to whoever started it, once."""
        server.trouble(f"{error.message}: what is shown is old")
        if not self._lost:
            self._say(f"{error.message}: waiting for it")
        self._lost = True

    def _well(self, server: FoxgloveServer) -> None:
        server.well()
        if self._lost:
            self._say("the daemon is back")
        self._lost = False


def forward(client: Client, live: LiveLog, send: Send) -> NoReturn:
    """Sends on what comes, on this thread.

    Raises:
        AxisyncError: the daemon is gone, or is another one now.
    """
    news = threading.Event()
    with client.setpoints() as setpoints, client.events() as events:
        setpoints.notify(news.set)
        events.notify(news.set)
        while True:
            if not news.wait(SILENCE_S):
                events.inquire()
            news.clear()
            while (batch := setpoints.poll()) is not None:
                for message in live.of_setpoints(batch):
                    send(message)
            while (event := events.poll()) is not None:
                for message in live.of_event(event):
                    send(message)
