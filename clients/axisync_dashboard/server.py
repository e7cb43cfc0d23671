"""The web server: one page, its socket, stops by POST, logs to download."""

import asyncio
import contextlib
import signal
from pathlib import Path
from types import FrameType

from nicegui import Client as Browser
from nicegui import app, background_tasks, ui
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.websockets import WebSocket

from axisync_dashboard import log_files, page
from axisync_dashboard.link import DaemonLink
from axisync_dashboard.live import Live
from axisync_dashboard.tab import Tab

STATIC = Path(__file__).parent / "static"
LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")
GRACE_S = 3
"""How long the end waits for answers under way, a download that somebody has paused for example."""
ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" fill="#1d4f91"/>'
    '<path d="M6 24 14 10l6 8 6-10" fill="none" stroke="#fff" stroke-width="3.5" stroke-linejoin="round"/></svg>'
)


class Server:
    """Everything that is served; `run` returns after SIGINT or SIGTERM."""

    def __init__(self, link: DaemonLink, programs: Path | None) -> None:
        self._link, self._programs = link, programs
        self._tabs: dict[str, Tab] = {}
        self._live = Live(link, self._tabs.get)
        self._frames: asyncio.Task[None] | None = None

    def run(self, host: str, port: int) -> None:
        """Serves until it is asked to end; prints the address when it begins to."""
        address = f"http://{f'[{host}]' if ':' in host else host}:{port}"
        app.add_static_files("/static", STATIC, max_cache_age=0)
        ui.page("/")(self._page)
        app.add_api_websocket_route("/live", self._socket)
        app.add_route("/stop", self._stop, methods=["POST"])
        app.add_route("/logs/{name}", self._log)
        app.add_route("/review/{name}", self._review)
        app.on_startup(self._begin)
        app.on_startup(lambda: print(f"dashboard: {address}", flush=True))
        app.on_shutdown(self._end)
        if host in LOOPBACK:
            # Another site's name that resolves to this machine must not open the page.
            app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(LOOPBACK))
        try:
            ui.run(
                host=host, port=port, title="axisync", favicon=ICON, dark=None, reload=False, show=False,
                show_welcome_message=False,
                tailwind=False, reconnect_timeout=5.0, uvicorn_logging_level="error", timeout_graceful_shutdown=GRACE_S,
            )  # fmt: skip
        finally:
            self._link.close()  # a second Ctrl-C makes the web server leave out what is to be done at its end

    def _begin(self) -> None:
        _end_once()
        self._link.start()
        self._frames = background_tasks.create(self._live.run(), name="frames")

    async def _end(self) -> None:
        if self._frames is not None:
            self._frames.cancel()
        # Zenoh must be closed before the interpreter ends, or it hangs.
        await asyncio.to_thread(self._link.close)

    def _page(self, client: Browser) -> None:
        tab = page.build(client, self._link, self._programs)
        if tab is not None:
            self._tabs[client.id] = tab
            client.on_delete(lambda: self._forget(client.id))

    def _forget(self, client_id: str) -> None:
        tab = self._tabs.pop(client_id, None)
        if tab is not None:
            tab.release_unseen()

    async def _socket(self, socket: WebSocket) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            await self._live.serve(socket)

    async def _stop(self, request: Request) -> Response:
        if request.headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            return PlainTextResponse("only from this page", status_code=403)
        return JSONResponse(await self._live.stop())

    def _log(self, request: Request) -> Response:
        path = self._log_path(request)
        return (
            PlainTextResponse("There is no such log.", 404) if path is None else FileResponse(path, filename=path.name)
        )

    async def _review(self, request: Request) -> Response:
        path = self._log_path(request)
        if path is None or not log_files.can_review():
            return PlainTextResponse("There is no such log, or no review of it.", 404)
        report = await log_files.review(path)
        return PlainTextResponse("This log cannot be reviewed.", 500) if report is None else HTMLResponse(report)

    def _log_path(self, request: Request) -> Path | None:
        info = self._link.telemetry.info
        return None if info is None else log_files.path_of(info.log_directory, request.path_params["name"])


def _end_once() -> None:
    """The web server's first signal ends it in order; one more would make it leave out the rest."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def end(number: int, frame: FrameType | None) -> None:
        for each in handlers:
            signal.signal(each, signal.SIG_IGN)
        handler = handlers[signal.Signals(number)]
        assert callable(handler)
        handler(number, frame)

    for number in handlers:
        signal.signal(number, end)
