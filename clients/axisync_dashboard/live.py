"""The socket behind each page: frames to the browser, signs of life, stops and jogs from it.

Beside NiceGUI's own socket, since the same bytes go to all viewers: a frame is made once, however many look.
"""

import asyncio
import contextlib
import json
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect

from axisync_client import AxisyncError
from axisync_dashboard.link import DaemonLink
from axisync_dashboard.telemetry import Frame
from axisync_dashboard.words import of_error

PERIOD_S = 0.05
MESSAGE_MAX = 1000
"""Characters; what a page sends is far shorter."""


class Page(Protocol):
    """What a socket's messages are for."""

    def alive(self) -> None:
        """The browser has shown a frame just now."""

    async def jog(self, pad: int, sign: int) -> str | None:
        """A pad is held; a sentence where it must be let go."""

    async def end_jog(self) -> None:
        """The pad was let go."""


@dataclass(eq=False)
class _Viewer:
    socket: WebSocket
    wake: asyncio.Event = field(default_factory=asyncio.Event)
    seen: int = -1


class Live:
    """Serves every page's socket; `run` makes the frames."""

    def __init__(self, link: DaemonLink, find_page: Callable[[str], Page | None]) -> None:
        self._link = link
        self._find_page = find_page
        self._viewers: set[_Viewer] = set()
        self._frame: Frame | None = None

    async def run(self) -> None:
        """A frame each period on a fixed grid, as long as anybody looks."""
        due = time.monotonic()
        while True:
            due = max(due + PERIOD_S, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            if self._viewers:
                self._frame = self._link.telemetry.frame()
                for viewer in self._viewers:
                    viewer.wake.set()

    async def serve(self, socket: WebSocket) -> None:
        """One page's socket, from its opening to its end."""
        if not same_origin(socket):
            await socket.close(1008)
            return
        await socket.accept()
        viewer = _Viewer(socket)
        self._viewers.add(viewer)
        sender = asyncio.create_task(self._send(viewer))
        try:
            await self._receive(viewer, socket.query_params.get("client", ""))
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page is gone; its lease follows when it gives no sign of life
        finally:
            self._viewers.discard(viewer)
            sender.cancel()

    async def _send(self, viewer: _Viewer) -> None:
        """Whoever is too slow for every frame gets the newest one whole."""
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                await viewer.wake.wait()
                viewer.wake.clear()
                frame = self._frame
                assert frame is not None
                await viewer.socket.send_text(frame.changes if frame.number == viewer.seen + 1 else frame.full)
                viewer.seen = frame.number

    async def _receive(self, viewer: _Viewer, client_id: str) -> None:
        tasks: set[asyncio.Task[None]] = set()

        def later(work: Awaitable[None]) -> None:
            task = asyncio.ensure_future(work)
            tasks.add(task)
            task.add_done_callback(tasks.discard)

        while True:
            message = parse(await viewer.socket.receive_text())
            page = self._find_page(client_id)
            if "stop" in message:
                later(self._stop(viewer, message["stop"]))
            elif page is not None and "ack" in message:
                page.alive()
            elif page is not None and "jog" in message:
                later(self._jog(viewer, page, message["jog"]))
            elif page is not None and "jogend" in message:
                later(page.end_jog())

    async def _stop(self, viewer: _Viewer, number: object) -> None:
        answer = {**await self.stop(), "id": number}
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            await viewer.socket.send_text(json.dumps(answer))

    async def stop(self) -> dict[str, Any]:
        """Stops everything; what to say about it."""
        begin = time.monotonic()
        try:
            await self._link.stop()
        except AxisyncError as error:
            return {"stopped": f"NOT STOPPED: {of_error(error)}", "failed": True}
        return {"stopped": f"Stop taken in {(time.monotonic() - begin) * 1e3:.0f} ms"}

    async def _jog(self, viewer: _Viewer, page: Page, held: object) -> None:
        if not (isinstance(held, list) and len(held) == 2 and all(type(number) is int for number in held)):
            return
        if await page.jog(held[0], held[1]) is not None:
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):
                await viewer.socket.send_text('{"jogoff":1}')


def parse(text: str) -> dict[str, Any]:
    """The message; empty where it is none of ours."""
    if len(text) > MESSAGE_MAX:
        return {}
    try:
        message = json.loads(text)
    except ValueError:
        return {}
    return message if isinstance(message, dict) else {}


def same_origin(socket: WebSocket) -> bool:
    """Another site's page must not listen, nor jog, through a browser that can reach us."""
    origin = socket.headers.get("origin")
    return origin is None or origin.partition("://")[2] == socket.headers.get("host")
