"""Viewers of the dashboard's page without a browser: what a page sends and takes, and nothing drawn.

Each loads the page, opens NiceGUI's socket and says hello, as its script does, so that the server works for it as for
a browser; and it takes the frames of the page's own socket, and acknowledges them as often as `live.js` does.
"""

import asyncio
import json
import re
import time

import aiohttp
import socketio  # type: ignore[import-untyped]

ACK_S = 0.2
FRAMES_BEFORE_READY = 20
_PAGE = re.compile(r'axisyncPage = \{client: "([^"]+)"')


def look(url: str, count: int) -> None:
    """So many viewers, until this process is ended; prints `ready` when all have had a second of frames."""
    asyncio.run(_look(url, count))


async def _look(url: str, count: int) -> None:
    ready = [asyncio.Event() for _ in range(count)]
    async with aiohttp.ClientSession() as session, asyncio.TaskGroup() as viewers:
        for one in ready:
            viewers.create_task(_view(session, url, one))
        for one in ready:
            await one.wait()
        print("ready", flush=True)


async def _view(session: aiohttp.ClientSession, url: str, ready: asyncio.Event) -> None:
    async with session.get(url) as page:
        found = _PAGE.search(await page.text())
    if found is None:
        raise RuntimeError(f"{url} is no page of the dashboard")
    browser = socketio.AsyncClient(handle_sigint=False)
    await browser.connect(url, socketio_path="/_nicegui_ws/socket.io", transports=["websocket"])
    hello = {"client_id": found[1], "tab_id": found[1], "document_id": found[1], "next_message_id": 0}
    if not await browser.call("handshake", hello):
        raise RuntimeError("NiceGUI does not know this viewer")
    async with session.ws_connect(f"{url}live", params={"client": found[1]}) as frames:
        await _take(frames, ready)


async def _take(frames: aiohttp.ClientWebSocketResponse, ready: asyncio.Event) -> None:
    taken, answered_s = 0, 0.0
    async for message in frames:
        frame = json.loads(message.data)
        taken += 1
        if taken == FRAMES_BEFORE_READY:
            ready.set()
        if time.monotonic() - answered_s > ACK_S:
            answered_s = time.monotonic()
            await frames.send_str(json.dumps({"ack": frame["n"]}))
    raise RuntimeError("the dashboard has closed the socket")
