"""foxglove: the log's topics live, for Foxglove."""

import signal
import sys
from importlib.util import find_spec
from typing import Annotated

import typer

from axisync_cli.options import EPILOG, terminal_of
from axisync_client import AxisyncError, ErrorCode

PORT = 8765
"""Where Foxglove looks unless told otherwise."""

Host = Annotated[str, typer.Option(help="Address to serve on. Whoever reaches it may look.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to serve on; 0 takes a free one.")]


class FoxgloveMissing(AxisyncError):
    """The extra `foxglove` is not installed."""

    code = ErrorCode.UNAVAILABLE


def add_to(app: typer.Typer) -> None:
    """Adds the command."""
    app.command(epilog=EPILOG)(foxglove)


def foxglove(context: typer.Context, host: Host = "127.0.0.1", port: Port = PORT) -> None:
    """Serve the log's topics live for Foxglove, until Ctrl-C."""
    terminal = terminal_of(context, False)
    if find_spec("foxglove") is None:
        raise FoxgloveMissing("the live view for Foxglove needs its SDK", "pip install 'axisync[foxglove]'")
    from axisync_foxglove.bridge import Bridge

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    Bridge(terminal.connect, host, port, terminal.show).serve()
