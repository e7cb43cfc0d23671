"""What every child process starts with: its arguments, its shared memory, its sockets, and an end it cannot outlive."""

import argparse
import ctypes
import logging
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import Phase
from axisync_schemas.memory import Control, Region, Word, inherited
from axisync_service.log_lines import LineSender

LOG_LEVEL_VARIABLE = "AXISYNC_LOG_LEVEL"
EXIT_CONFIGURATION = 3
"""Exit code of a child for which starting again would not help: the supervisor gives up."""
NO_LINES = frozenset({"controller"})
"""Processes whose log lines stay on stderr: the cycle sends nothing but its events, which become lines in the log."""
_PR_SET_PDEATHSIG = 1
_terminated = False


@dataclass(frozen=True, slots=True)
class ProcessContext:
    """A child's surroundings.

    Attributes:
        regions: shared memory by name (`axisync_schemas.memory.REGIONS`).
        sockets: inherited socket descriptors by name.
        parent: process id of the supervisor.
    """

    cell: Cell
    cell_text: str
    run_dir: Path
    log_dir: Path
    listen: str
    control: Control
    regions: dict[str, Region]
    sockets: dict[str, int]
    parent: int

    def phase(self) -> Phase:
        """RUNNING until the supervisor says otherwise, ends, or a SIGTERM came."""
        phase = Phase(self.control[Word.PHASE])
        if phase is Phase.RUNNING and (_terminated or os.getppid() != self.parent):
            return Phase.STOPPING
        if phase is Phase.STOPPING and os.getppid() != self.parent and self.control[Word.CONTROLLER_DONE]:
            return Phase.CLOSING
        return phase


def start(name: str, arguments: Sequence[str] | None = None) -> ProcessContext:
    """Parses the arguments, ties this process to its parent and sets up logging. Call from the main thread."""
    options = _parser(name).parse_args(arguments)
    parent = die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _terminate)
    set_up_logging(name)
    cell, text = read_cell(Path(options.cell))
    if options.simcan:
        cell = cell.on_simcan(options.simcan)
    descriptors = {key: int(fd) for key, fd in (item.split(":") for item in options.fds.split(","))}
    regions = inherited(descriptors)
    if "log" in descriptors and name not in NO_LINES:
        logging.getLogger().addHandler(LineSender(name, descriptors["log"]))
    return ProcessContext(
        cell=cell,
        cell_text=text,
        run_dir=Path(options.run_dir),
        log_dir=Path(options.log_dir),
        listen=options.listen,
        control=Control(regions["control"].map(), len(cell.groups)),
        regions=regions,
        sockets={key: fd for key, fd in descriptors.items() if key not in regions},
        parent=parent,
    )


def _parser(name: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"axisync-{name}", description="Started by axisyncd.")
    parser.add_argument("--cell", required=True)
    parser.add_argument("--run-dir", required=True)
    parser.add_argument("--log-dir", required=True)
    parser.add_argument("--listen", required=True)
    parser.add_argument("--simcan", default="")
    parser.add_argument("--fds", required=True)
    return parser


def die_with_parent(signal_number: int = signal.SIGTERM) -> int:
    """Has the kernel send `signal_number` when the parent ends; returns the parent's id.

    The parent must spawn from its main thread: the signal fires when the spawning thread ends.
    """
    parent = os.getppid()
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal_number, 0, 0, 0)
    if os.getppid() != parent:  # It ended before prctl took effect.
        sys.exit(1)
    return parent


def _terminate(_signal: int, _frame: object) -> None:
    global _terminated
    _terminated = True


def set_up_logging(name: str) -> None:
    """One line an event on stderr: time, level, process, then the message's key=value pairs.

    Warnings pass the root logger whatever stderr shows, since the log's `/log` wants them.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(os.environ.get(LOG_LEVEL_VARIABLE, "INFO").upper())
    handler.setFormatter(
        logging.Formatter(f"%(asctime)s.%(msecs)03d %(levelname)s {name} %(message)s", datefmt="%H:%M:%S")
    )
    root = logging.getLogger()
    root.addHandler(handler)
    root.setLevel(min(handler.level, logging.WARNING))
