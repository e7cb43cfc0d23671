"""CPU time and memory of each process of the service."""

import re
import time
from dataclasses import dataclass

import psutil  # type: ignore[import-untyped]

_MODULE = re.compile(r"axisync_(?:service|emulator)\.(\w+)\Z")
_PROGRAM = re.compile(r"(?:.*/)?(axisyncd|axisync-emulator)\Z")
_NAMES = {"main": "supervisor", "recorder_process": "recorder", "planner_worker": "planner"}


def label(command: list[str]) -> str:
    """What a process is, by its command line: `python -m axisync_service.front` is "front"."""
    for argument in command:
        if program := _PROGRAM.match(argument):
            return "supervisor" if program[1] == "axisyncd" else _emulator(command)
        if module := _MODULE.match(argument):
            emulator = argument.startswith("axisync_emulator")
            return _emulator(command) if emulator else _NAMES.get(module[1], module[1])
    return command[0].rsplit("/", 1)[-1] if command else "?"


def _emulator(command: list[str]) -> str:
    """There may be one for each bus."""
    bus = command.index("--bus") + 1 if "--bus" in command else len(command)
    return " ".join(["emulator", *command[bus : bus + 1]])


@dataclass(frozen=True, slots=True)
class Usage:
    """Of one process, over the time between two looks.

    Attributes:
        cpu: share of one core.
        memory_mib: proportional set size where the kernel tells it, else resident.
    """

    name: str
    pid: int
    cpu: float
    memory_mib: float
    threads: int


class Sampler:
    """Looks at a process and its descendants at construction and again at `usage`."""

    def __init__(self, root: int, *others: tuple[str, int]) -> None:
        """`others`: more processes, with the names to show them by."""
        self._processes = [(label(process.cmdline()), process) for process in family(root)]
        self._processes += [(name, psutil.Process(pid)) for name, pid in others]
        self._before = {process.pid: _cpu_s(process) for _, process in self._processes}
        self._began = time.monotonic()

    def usage(self) -> list[Usage]:
        """Since construction. A process that has ended meanwhile is left out."""
        elapsed = time.monotonic() - self._began
        return [
            Usage(
                name,
                process.pid,
                (_cpu_s(process) - self._before[process.pid]) / elapsed,
                _memory_mib(process),
                process.num_threads(),
            )
            for name, process in self._processes
            if process.is_running()
        ]


def family(root: int) -> list[psutil.Process]:
    """The process and all its descendants."""
    parent = psutil.Process(root)
    return [parent, *parent.children(recursive=True)]


def find(root: int, name: str) -> psutil.Process:
    """The process that `label` calls `name`.

    Raises:
        LookupError: none.
    """
    for process in family(root):
        if label(process.cmdline()) == name:
            return process
    raise LookupError(f"there is no {name} among the processes of {root}")


def _cpu_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def _memory_mib(process: psutil.Process) -> float:
    try:
        memory = process.memory_full_info()
    except psutil.AccessDenied:
        return float(process.memory_info().rss) / 2**20
    return float(memory.pss) / 2**20
