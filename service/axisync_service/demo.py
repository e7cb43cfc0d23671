"""`axisyncd demo`: emulated drives beside the real service, and a short program played by a real client."""

import contextlib
import math
import os
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from axisync_schemas.cell import Cell, override
from axisync_schemas.memory import Control, Word
from axisync_service.recorder.retention import log_files

EMULATOR_PRIORITY = 60
PATIENT: dict[str, float | int] = {
    "missed_ticks_max": 50,
    "tpdo_missed_max": 50,
    "controller_heartbeat_timeout_ms": 500,
    "drive_heartbeat_timeout_ms": 2000,
}
"""What the demo's cell file has at least: emulated drives share the machine, and a late process is no fault then."""
LATE_TICKS_MAX = 10
"""With real-time priority the controller itself is hardly ever late; the drives may be late all the same."""
PROGRAMS = Path(__file__).parent / "programs"
SLOW = ("--speed", "50%")
REVIEW_WAIT_S = 10.0
"""Ticks reach the kernel within a second, unless the disk is full."""


def patient(text: str, realtime: bool) -> str:
    """The cell file's text for drives that are processes of this machine."""
    given = tomllib.loads(text)
    least = PATIENT | ({"missed_ticks_max": LATE_TICKS_MAX} if realtime else {})
    return override(text, {key: max(value, given.get(key, value)) for key, value in least.items()})


def program_for(cell: Cell) -> tuple[tuple[str, ...], ...]:
    """The paper's two experiments on the robot, V.C, as far as the cell has the groups for them.

    The tool passes the body closely: where drives may go on alone for long, only at half speed.
    """
    speed = SLOW if cell.missed_ticks_max > LATE_TICKS_MAX else ()
    wanted = (("kingkong", "tool_change.toml", speed), ("wukong", "wukong_points.toml", ()))
    runs = [("run", shown(PROGRAMS / file), *more) for group, file, more in wanted if group in cell.group_names]
    return (("enable", "all"), *runs)


def shown(path: Path) -> str:
    """The path as a person would type it: from here, where it is below."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def joint_argument(degrees: tuple[float, ...]) -> str:
    """Joint positions as the command line takes them."""
    return ",".join(f"{value:g}" for value in degrees) + "deg"


def kernel_has(cell: Cell) -> bool:
    """Every bus of the cell is a CAN interface of this kernel, and up."""
    return all(_interface_up(bus.channel) for bus in cell.buses)


def _interface_up(name: str) -> bool:
    with contextlib.suppress(OSError, ValueError):
        return bool(int(Path(f"/sys/class/net/{name}/flags").read_text(), 16) & 1)
    return False


class EmulatorFailed(Exception):
    """The emulated drives did not come up; one sentence."""


@dataclass(frozen=True, slots=True)
class Extras:
    """Directories for what emulators do besides: a log of all frames, and sockets that take faults, a file a bus."""

    candump: Path | None = None
    control: Path | None = None

    def make(self) -> None:
        """The directories.

        Raises:
            EmulatorFailed: one cannot be made.
        """
        for directory in filter(None, (self.candump, self.control)):
            try:
                directory.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise EmulatorFailed(f"the directory {directory} cannot be made: {error.strerror}") from None

    def options(self, bus: str) -> list[str]:
        """For the emulator of one bus."""
        return [
            *(("--candump", str(self.candump / f"{bus}.log")) if self.candump else ()),
            *(("--control", str(self.control / f"{bus}.sock")) if self.control else ()),
        ]


@dataclass(slots=True)
class Emulators:
    """One emulator process a bus, out of reach of Ctrl-C: the service still needs the drives while it stops."""

    processes: list[subprocess.Popen[str]] = field(default_factory=list)

    def start(self, cell_file: Path, cell: Cell, simcan: str, extras: Extras = Extras()) -> None:
        """Starts them and waits until their buses are there.

        Raises:
            EmulatorFailed: one ended, or said nothing; or a directory of `extras` cannot be made.
        """
        extras.make()
        for bus in cell.buses:
            command = [sys.executable, "-m", "axisync_emulator.main", str(cell_file), "--bus", bus.name]
            command += ["--die-with-parent", *(("--simcan", simcan) if simcan else ())]
            command += extras.options(bus.name)
            self.processes.append(
                subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, start_new_session=True
                )
            )
        for process in self.processes:
            assert process.stdout is not None
            if process.stdout.readline().strip() != "ready":
                self.stop()
                raise EmulatorFailed(f"the emulated drives did not start (exit code {process.returncode})")
            # Real drives do not wait for a scheduler. Below the controller, above everything else; where permitted.
            with contextlib.suppress(PermissionError):
                os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(EMULATOR_PRIORITY))

    def stop(self) -> None:
        """Ends them."""
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait()
            if process.stdout:
                process.stdout.close()
        self.processes.clear()


Words = tuple[str, ...]
"""A command line of `axisync`, without its first word."""
Last = Callable[[], Words | None]


class Program:
    """Plays commands of the `axisync` command line one after the other, each a process of its own."""

    def __init__(self, endpoint: str, commands: tuple[Words, ...], last: Last = lambda: ()) -> None:
        """`last` is asked until it gives one more command, or (): how that one ends does not matter."""
        self._endpoint = endpoint
        self._commands: Iterator[Words] = iter(commands)
        self._last = last
        self._at_last = False
        self._command: Words = ()
        self._process: subprocess.Popen[bytes] | None = None
        self.begun = self.done = False
        self.failed: str | None = None

    def begin(self) -> None:
        """The service is ready."""
        self.begun = True

    def poll(self) -> bool:
        """Starts the next command when the last one has ended; True once, when the program is over."""
        if not self.begun or self.done:
            return False
        if self._process is not None:
            code = self._process.poll()
            if code is None:
                return False
            if self._at_last:
                return self._finish()
            if code != 0:
                self.failed = f"axisync {' '.join(self._command)} ended with exit code {code}"
                self._commands = iter(())
        self._process = None
        command = next(self._commands, None)
        if command is None:
            command = self._last()
            if command is None:
                return False
            if not command:
                return self._finish()
            self._at_last = True
        self._command = command
        print(f"$ axisync {' '.join(command)}", flush=True)
        environment = {**os.environ, "AXISYNC_ENDPOINT": self._endpoint}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "axisync_cli.main", *command], stdin=subprocess.DEVNULL, env=environment
        )
        return False

    def _finish(self) -> bool:
        self.done = True
        return True

    def stop(self) -> None:
        """Waits for a command that is under way: it hears of the service's end by itself."""
        if self._process is not None and self._process.poll() is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(5.0)
            self._process.kill()
            self._process.wait()


class ReviewOfRun:
    """The command that reviews what the demo has logged, once all of it has reached the kernel."""

    def __init__(self, control: Control, log_dir: Path, cell: Cell) -> None:
        self._control, self._directory, self._cell = control, log_dir, cell
        self._before = {kept.path for kept in log_files(log_dir, cell.name)}
        self._until: tuple[int, float] | None = None

    def __call__(self) -> Words | None:
        """None: not yet; (): there is nothing to review."""
        if self._until is None:
            self._until = self._control[Word.CONTROLLER_TICK], time.monotonic() + REVIEW_WAIT_S
        tick, latest = self._until
        if self._control[Word.RECORDER_CURSOR] <= tick and time.monotonic() < latest:
            return None
        found = [kept.path for kept in log_files(self._directory, self._cell.name) if not kept.name.fault]
        files = [shown(path) for path in found if path not in self._before]
        return ("review", *files) if files else ()


def next_steps(cell: Cell, endpoint: str, log_dir: Path) -> str:
    """What to try after the program."""
    group = cell.groups[-1]
    target = joint_argument(tuple(round(math.degrees(axis.drive.start)) + 20 for axis in group.axes))
    axisync = ".venv/bin/axisync" + ("" if endpoint.endswith(":7447") else f" --endpoint {endpoint}")
    both = any(compound.name == "both" for compound in cell.compounds)
    logs = sorted(log_dir.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    return "\n".join(
        (
            "The arms stand, enabled. In another terminal:",
            f"  {axisync} state",
            f"  {axisync} move {group.name} --joint {target}",
            *((f"  {axisync} run {shown(PROGRAMS / 'two_arms.toml')}",) if both else ()),
            f"  {axisync} stop",
            f"Every setpoint is in {logs[-1] if logs else log_dir}",
            "Ctrl-C stops the arms, disables the drives and ends the service.",
        )
    )
