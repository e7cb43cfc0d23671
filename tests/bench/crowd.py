"""What else may go on beside a moving cell, as processes of their own: `crowd.py plan|watch|pages ADDRESS N`.

plan: N clients ask for plans as fast as they get answers. watch: N clients subscribe to every tick. pages: N viewers
of the dashboard at ADDRESS.
"""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import viewers

from axisync_client import AxisyncError, Client, deg

READY_S = 60.0


class Crowd:
    """Clients in another process, for the length of a block."""

    def __init__(self, what: str, endpoint: str, count: int) -> None:
        self._command = [sys.executable, str(Path(__file__)), what, endpoint, str(count)]
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        process = subprocess.Popen(self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                   preexec_fn=lambda: os.nice(5))  # fmt: skip
        self._process = process
        assert process.stdout is not None
        if process.stdout.readline().strip() != "ready":
            self._end()
            raise RuntimeError(f"{' '.join(self._command[1:])} did not get ready")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def _end(self) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.communicate()


def plan(client: Client) -> None:
    """Asks for a plan, again and again."""
    group = next(iter(client.state().groups))
    count = len(client.config().axis_indices(group))
    while True:
        try:
            client.plan_joint(group, deg(*[3.0] * count), relative=True)
        except AxisyncError:
            time.sleep(0.01)  # refused, since so many ask


def watch(client: Client) -> None:
    """Takes every tick."""
    for _ in client.setpoints():
        pass


def main(what: str, address: str, count: int) -> None:
    if what == "pages" and count:
        viewers.look(address, count)
        return
    clients = [Client(address) for _ in range(count)]
    for client in clients:
        threading.Thread(target={"plan": plan, "watch": watch}[what], args=(client,), daemon=True).start()
    print("ready", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
