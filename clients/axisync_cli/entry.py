"""Where `axisync` begins: Ctrl-C while it is still being loaded just ends it, for nothing moves yet."""

import os
import signal
from types import FrameType

EXIT_INTERRUPTED = 130


def main() -> int:
    """Loads the command and runs it; its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where a shell has it ignored
        signal.signal(signal.SIGINT, _leave)
    from axisync_cli.main import main as run

    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return run()


def _leave(signal_number: int, frame: FrameType | None) -> None:
    os._exit(EXIT_INTERRUPTED)
