"""The real service for system tests, in a runtime directory of its own: `axisyncd demo` without its program, or
`axisyncd run` beside drives that outlive it, as on a real robot."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from axisync_schemas.cell import override, read_cell
from axisync_service.demo import PATIENT, Emulators, Extras
from support.cells import eod_text

READY_S = 180.0
STOP_S = 20.0
CHILDREN = {
    "front": "axisync_service.front",
    "planner": "axisync_service.planner_worker",
    "controller": "axisync_service.controller",
    "recorder": "axisync_service.recorder_process",
    "emulator": "axisync_emulator.main",
}


def patient(text: str) -> str:
    """The same cell for a machine that other work shares: it waits longer before it calls a pause a fault."""
    return override(text, PATIENT)


def unhurried(text: str) -> str:
    """The same cell with a slow cycle, as patient: clients do not care, and the machine has time for them."""
    return override(patient(text), {"period_ms": 8.0, "missed_ticks_max": 13, "tpdo_missed_max": 13})


def free_port() -> int:
    """A TCP port on loopback that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Daemon:
    """One run of the service.

    Attributes:
        endpoint: where clients connect.
        log_dir, frames_dir: its log files, and one candump file a bus.
        output: what it printed (stdout and stderr).
    """

    def __init__(
        self, directory: Path, cell_text: str | None = None, arguments: tuple[str, ...] = (), drives_apart: bool = False
    ) -> None:
        self.directory = directory
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.log_dir, self.frames_dir = directory / "logs", directory / "frames"
        self.frames_dir.mkdir(parents=True, exist_ok=True)
        self.cell_file = directory / "cell.toml"
        self.cell_file.write_text(cell_text or patient(eod_text()), encoding="utf-8")
        self._arguments = arguments
        self._simcan = directory / "buses" if drives_apart else None
        self._emulators = Emulators()
        self.runtime_directory = Path(tempfile.mkdtemp(prefix="axisync-"))  # a socket's path is short, pytest's is not
        self._output = directory / "output.txt"
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def environment(self) -> dict[str, str]:
        """Its own runtime and state directories: runs neither lock each other out nor know each other's homes."""
        own = {"XDG_RUNTIME_DIR": str(self.runtime_directory), "XDG_STATE_HOME": str(self.directory / "state")}
        return {**os.environ, **own, "AXISYNC_LOG_LEVEL": "INFO"}

    @property
    def output(self) -> str:
        """What it printed so far."""
        return self._output.read_text(encoding="utf-8", errors="replace") if self._output.exists() else ""

    @property
    def command(self) -> list[str]:
        """How it is started."""
        common = ["--log-dir", str(self.log_dir), "--listen", self.endpoint, *self._arguments]
        service = [sys.executable, "-m", "axisync_service.main"]
        if self._simcan is not None:
            return [*service, "run", str(self.cell_file), "--simcan", str(self._simcan), *common]
        demo = ["demo", "--no-program", "--no-dashboard", "--cell", str(self.cell_file)]
        return [*service, *demo, "--candump", str(self.frames_dir), *common]

    def start(self) -> "Daemon":
        """Starts it and waits until moves are accepted."""
        if self._simcan is not None and not self._emulators.processes:
            cell, _ = read_cell(self.cell_file)
            self._emulators.start(self.cell_file, cell, str(self._simcan), Extras(candump=self.frames_dir))
        with self._output.open("wb") as output:
            self.process = subprocess.Popen(
                self.command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, env=self.environment
            )
        try:
            wait_for(lambda: "ready\n" in self.output or self.process.poll() is not None, "ready", READY_S)  # type: ignore[union-attr]
        except AssertionError as late:
            raise AssertionError(f"{late}\n{self.output}") from None
        assert self.process.poll() is None, self.output
        assert "not there yet" not in self.output, self.output
        return self

    def stop(self, number: int = signal.SIGINT) -> int:
        """Ends it as a person would; its exit code."""
        assert self.process is not None
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f"the daemon did not end\n{self.output}") from None

    def kill(self) -> None:
        """Ends whatever is left."""
        self._emulators.stop()
        for pid in self.pids():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        if self.process is not None:
            self.process.kill()
            self.process.wait()

    def pids(self, name: str | None = None) -> list[int]:
        """Processes of this run, by its directories in their arguments: the named kind, or all of the service."""
        marks = str(self.directory), str(self.runtime_directory)
        found = []
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            with contextlib.suppress(OSError):
                arguments = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                drives = CHILDREN["emulator"] in arguments
                wanted = CHILDREN[name] in arguments if name else not (drives and self._simcan)
                if wanted and any(mark in argument for argument in arguments for mark in marks):
                    found.append(int(entry.name))
        return found

    def pid(self, name: str) -> int:
        """The one process of a kind."""
        (pid,) = self.pids(name)
        return pid


def wait_for(condition: Callable[[], bool], what: str, seconds: float) -> None:
    """Polls until `condition` holds."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {seconds:g} s: {what}")
        time.sleep(0.02)


@contextlib.contextmanager
def running(
    directory: Path, cell_text: str | None = None, arguments: tuple[str, ...] = (), drives_apart: bool = False
) -> Iterator[Daemon]:
    """A daemon for the length of a block; nothing of it is left afterwards, whatever happened."""
    daemon = Daemon(directory, cell_text, arguments, drives_apart)
    try:
        yield daemon.start()
    finally:
        if daemon.process is not None and daemon.process.poll() is None:
            daemon.process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                daemon.process.wait(STOP_S)
        daemon.kill()
        shutil.rmtree(daemon.runtime_directory)
