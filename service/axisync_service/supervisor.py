"""The supervisor: parent of front, planner, controller and recorder. Imports neither zenoh nor mcap nor numpy."""

import contextlib
import datetime
import logging
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import Phase
from axisync_schemas.events import EventKind
from axisync_schemas.internal import CONTROLLER_STATUS, LogEntry
from axisync_schemas.memory import Mailbox, Word
from axisync_schemas.replies import Event
from axisync_schemas.topics import LOG_EVENTS
from axisync_service.daemon.children import MODULES, Child, Restarts, describe_exit
from axisync_service.daemon.homed import HomedFile
from axisync_service.daemon.locks import Locks
from axisync_service.daemon.surroundings import make_surroundings
from axisync_service.log_lines import LineSender
from axisync_service.process import EXIT_CONFIGURATION, set_up_logging

POLL_S = 0.05
STOP_S = 5.0
DRIVES_READY_S = 15.0
DRIVES_READY_TICKS = 1000
"""How long absent drives are waited for: the service is of use without them. Bring-up takes some hundred ticks."""
PROCESSES_READY_S = 90.0
"""A planner that compiles itself for the first time takes a while."""
WATCHDOG_NS = 2_000_000_000
"""The cycle feeds it every tick; a hanging controller is killed, and the drives stop by themselves."""
_SIGNS_OF_LIFE = {"front": Word.FRONT_READY, "planner": Word.PLANNER_NS, "recorder": Word.RECORDER_STATE}
_log = logging.getLogger("supervisor")


class Supervisor:
    """One run of the service.

    Attributes:
        on_ready: called once, when moves are accepted.
        each_poll: called in every turn of the loop; the demo plays its program there.
    """

    def __init__(self, cell: Cell, cell_text: str, log_dir: Path, listen: str, simcan: str = "") -> None:
        """
        Raises:
            CannotRun: another daemon serves this cell or one of its buses, or there is no place for its sockets.
        """
        self.cell, self.log_dir, self.listen = cell, log_dir, listen
        self._locks = Locks(cell)
        self._here = make_surroundings(cell, cell_text)
        self.control = self._here.control
        self._status = Mailbox(self._here.regions["status"].map(writable=False))
        arguments = [
            "--cell", str(self._here.run_dir / "cell.toml"), "--run-dir", str(self._here.run_dir),
            "--log-dir", str(log_dir), "--listen", listen, "--simcan", simcan,
        ]  # fmt: skip
        self.children = {name: Child(name, arguments, self._here.descriptors(name)) for name in MODULES}
        self.on_ready: Callable[[list[str]], None] = lambda _: None
        self.each_poll: Callable[[], None] = lambda: None
        self._restarts = Restarts()
        self._homed = HomedFile(cell)
        self._asked_to_stop = False
        self._failed = False

    def run(self) -> int:
        """Runs until SIGINT or SIGTERM, or until it cannot go on; the exit code."""
        set_up_logging("supervisor")
        logging.getLogger().addHandler(LineSender("supervisor", self._here.log["supervisor"][0].fileno()))
        wake = self._catch_signals()
        try:
            for child in self.children.values():
                child.start()
            self._loop(wake)
        finally:
            self._stop()
            self._here.close()
            self._locks.release()
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.close(signal.set_wakeup_fd(-1))
            wake.close()
        return 1 if self._failed else 0

    def _catch_signals(self) -> socket.socket:
        """Signals wake the loop through a socket, so that none is acted on late."""
        receiver, sender = socket.socketpair()
        for end in (receiver, sender):
            end.setblocking(False)
        signal.set_wakeup_fd(sender.detach(), warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask_to_stop)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        return receiver

    def _ask_to_stop(self, _signal: int, _frame: object) -> None:
        self._asked_to_stop = True

    def _loop(self, wake: socket.socket) -> None:
        started, told = time.monotonic(), False
        for_drives = max(DRIVES_READY_S, DRIVES_READY_TICKS * self.cell.period)
        while not (self._asked_to_stop or self._failed):
            select.select([wake], [], [], POLL_S)
            with contextlib.suppress(BlockingIOError):
                wake.recv(1024)
            self.control[Word.SUPERVISOR_NS] = time.monotonic_ns()
            self._watch()
            self._homed.follow(self.control, self._status)
            if not told:
                processes, drives = self._waiting_for()
                patience = PROCESSES_READY_S if processes else for_drives
                if not (processes or drives) or time.monotonic() - started > patience:
                    told = True
                    self.on_ready(processes + drives)
            self.each_poll()

    # --- watching -----------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        fed = self.control[Word.CONTROLLER_NS]
        if fed and time.monotonic_ns() - fed > WATCHDOG_NS:
            _log.error("process=controller action=kill reason=watchdog")
            self.children["controller"].kill()
            self.children["controller"].wait(1.0)
        for child in self.children.values():
            code = child.ended()
            if code is not None:
                self._on_death(child, code)

    def _on_death(self, child: Child, code: int) -> None:
        text = f"{child.name} {describe_exit(code)}"
        self._event(EventKind.PROCESS_DIED, text, process=child.name, exit_code=code)
        if child.name == "controller":
            self.control[Word.CONTROLLER_NS] = 0
        hopeless = code == EXIT_CONFIGURATION or (child.name == "recorder" and self.control[Word.RECORDER_STATE] == 0)
        if hopeless or not self._restarts.allowed():
            why = "it cannot start" if hopeless else "it has ended too often"
            print(f"axisyncd: {text}; {why}, the service stops", file=sys.stderr)
            self._failed = True
            child.process = None
            return
        _log.error("process=%s event=died how=%r action=restart", child.name, describe_exit(code))
        child.start()

    def _event(self, kind: EventKind, message: str, **details: object) -> None:
        event = Event(
            source="supervisor",
            kind=kind.value,
            now_s=time.monotonic(),
            wall_time=datetime.datetime.now(datetime.UTC).isoformat(timespec="microseconds"),
            message=message,
            severity="error",
            details=details,
        )
        entry = LogEntry(topic=LOG_EVENTS, log_time_ns=time.monotonic_ns(), data=event.model_dump(mode="json"))
        with contextlib.suppress(OSError):
            self._here.log["supervisor"][0].send(entry.model_dump_json().encode())

    def _waiting_for(self) -> tuple[list[str], list[str]]:
        """Processes, and drives, that are still missing before moves can be accepted."""
        processes = [name for name, word in _SIGNS_OF_LIFE.items() if not self.control[word]]
        payload = self._status.read()
        if payload is None:
            return [*processes, "controller"], []
        status = CONTROLLER_STATUS.validate_json(payload)
        missing = []
        for name, group in zip(self.cell.group_names, status.groups, strict=True):
            if not group.ready:
                errors = [status.drives[axis].error for axis in self.cell.axis_indices(name)]
                missing.append("; ".join(error for error in errors if error) or f"the drives of {name}")
        return processes, missing

    # --- stopping -----------------------------------------------------------------------------------------------

    def _stop(self) -> None:
        """Refuse moves, stop groups, disable drives; then drain the recorder and close Zenoh."""
        self.control[Word.PHASE] = Phase.STOPPING
        self._await(["controller"])
        self._homed.follow(self.control, self._status)
        self.control[Word.PHASE] = Phase.CLOSING
        self._await(["recorder", "planner", "front"])

    def _await(self, names: list[str]) -> None:
        deadline = time.monotonic() + STOP_S
        for name in names:
            child = self.children[name]
            if not child.wait(deadline - time.monotonic()):
                _log.error("process=%s action=kill reason=does_not_end", name)
                child.kill()
                child.wait(STOP_S)
