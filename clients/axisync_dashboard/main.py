"""`axisync-dashboard`: the command line. Exit: 0 done, 1 cannot serve, 2 usage."""

import ctypes
import importlib.util
import os
import signal
import socket
import sys
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

PORT = 7448
_PR_SET_PDEATHSIG = 1

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def serve(
    endpoint: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="HOST:PORT of the daemon; else AXISYNC_ENDPOINT, then local.")
    ] = None,
    cell: Annotated[str | None, typer.Option(metavar="NAME", help="Else AXISYNC_CELL, then the only one.")] = None,
    user: Annotated[str | None, typer.Option(metavar="NAME", help="Else AXISYNC_USER, then anonymous.")] = None,
    host: Annotated[str, typer.Option(help="Address to serve on. Whoever reaches it may take control.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port to serve on.")] = PORT,
    programs: Annotated[
        Path | None, typer.Option(file_okay=False, exists=True, help="Directory of programs; else the service's.")
    ] = None,
    die_with_parent: Annotated[bool, typer.Option(hidden=True)] = False,
) -> None:
    """Serve the web page of an axisync daemon, until SIGINT or SIGTERM."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    if die_with_parent:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if importlib.util.find_spec("nicegui") is None:
        raise _failure("NiceGUI is not installed: pip install 'axisync[dashboard]'")
    if (reason := _cannot_bind(host, port)) is not None:
        raise _failure(f"cannot serve on {host}:{port} ({reason}): choose another --port")
    _serve(endpoint, cell, user, host, port, programs or _programs_of_the_service())


def _serve(
    endpoint: str | None, cell: str | None, user: str | None, host: str, port: int, programs: Path | None
) -> None:
    # Nothing is kept between runs, and nothing is written beside the program.
    os.environ.setdefault("NICEGUI_STORAGE_PATH", os.path.join(os.environ.get("TMPDIR", "/tmp"), "axisync-dashboard"))
    from axisync_client import AxisyncError
    from axisync_client.settings import resolve
    from axisync_dashboard.link import Address, DaemonLink
    from axisync_dashboard.server import Server
    from axisync_dashboard.telemetry import Telemetry

    try:
        resolve(endpoint, cell, user, os.environ)
    except AxisyncError as error:
        raise _failure(str(error)) from None
    server = Server(DaemonLink(Address(endpoint, cell, user), Telemetry()), programs)
    server.run(host, port)


def _end(_number: int, _frame: FrameType | None) -> None:
    """Ends the program; the web server raises the signal that ended it once more when it has closed everything.

    One more signal is ignored from here on: the interpreter gives signals their default action back before it ends, and
    a second Ctrl-C, or the parent's SIGTERM after the terminal's SIGINT, would kill it there.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    sys.exit(0)


def _failure(sentence: str) -> typer.Exit:
    typer.echo(f"axisync-dashboard: {sentence}", err=True)
    return typer.Exit(1)


def _cannot_bind(host: str, port: int) -> str | None:
    """Why not, in words; None where it can be served there."""
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        return error.strerror or str(error)
    return None


def _programs_of_the_service() -> Path | None:
    """Where the service is installed beside us, its programs."""
    found = importlib.util.find_spec("axisync_service")
    places = [] if found is None else list(found.submodule_search_locations or [])
    return Path(places[0]) / "programs" if places else None


def main() -> None:
    """Entry point."""
    app()


if __name__ in {"__main__", "__mp_main__"}:
    main()
