"""The real service, started as a user starts it."""

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

READY = "ready"
READY_S, EXIT_S = 60.0, 20.0
_PR_SET_PDEATHSIG = 1


class DaemonError(RuntimeError):
    """It did not do what the bench needs; the message ends with what it printed last."""


class Daemon:
    """`axisyncd demo --no-dashboard` on a port of its own, logging into `directory`. A context manager."""

    def __init__(self, directory: Path, cell_text: str | None = None) -> None:
        """`cell_text`: in the place of the demo's own cell file."""
        self.directory = directory
        cell: tuple[str, ...] = ()
        if cell_text is not None:
            (directory / "cell.toml").write_text(cell_text, encoding="utf-8")
            cell = ("--cell", str(directory / "cell.toml"))
        self.endpoint = f"tcp/127.0.0.1:{_free_port()}"
        self.lines: list[str] = []
        self._ready = threading.Event()
        self._process = subprocess.Popen(
            [
                *_program(),
                "demo",
                "--no-dashboard",
                "--no-program",
                "--log-dir",
                str(directory),
                "--listen",
                self.endpoint,
                *cell,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
            preexec_fn=_end_with_parent,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Of the supervisor."""
        return self._process.pid

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip())
            if line.strip().startswith(READY):
                self._ready.set()

    def wait_ready(self) -> None:
        """Until moves are accepted.

        Raises:
            DaemonError: it ended before, or took too long.
        """
        end = time.monotonic() + READY_S
        while not self._ready.wait(0.1):
            if self._process.poll() is not None:
                raise self.error(f"axisyncd ended with {self._process.returncode} before it was ready")
            if time.monotonic() > end:
                raise self.error(f"axisyncd was not ready after {READY_S:g} s")

    def error(self, what: str) -> DaemonError:
        """With the newest lines of its output."""
        return DaemonError("\n  ".join([what, *self.lines[-15:]]))

    def stop(self) -> None:
        """Has it end cleanly, which completes the log.

        Raises:
            DaemonError: it did not, or with an exit code.
        """
        self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(EXIT_S)
        except subprocess.TimeoutExpired:
            raise self.error(f"axisyncd did not end within {EXIT_S:g} s") from None
        if code not in (0, 130):
            raise self.error(f"axisyncd ended with {code}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends whatever is still there, by force after a while."""
        if self._process.poll() is None:
            self._process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(EXIT_S)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._reader.join(5.0)

    def logs(self) -> list[Path]:
        """Its log files, oldest first.

        Raises:
            DaemonError: there is none.
        """
        files = sorted(self.directory.glob("*.mcap"))
        if not files:
            raise self.error(f"{self.directory} holds no log")
        return files


def _end_with_parent() -> None:
    """In the child: SIGTERM when the bench ends, even by SIGKILL. Its own children end with it."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)


def _program() -> list[str]:
    installed = Path(sys.executable).with_name("axisyncd")
    return [str(installed)] if installed.exists() else [sys.executable, "-m", "axisync_service.main"]


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
