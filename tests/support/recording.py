"""The recorder's real process on shared memory of the test's own, and a feeder in the controller's place."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from axisync_schemas import memory
from axisync_schemas.cell import read_cell
from axisync_schemas.enumerations import Phase
from axisync_schemas.internal import LogEntry
from axisync_schemas.memory import Control, Word
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import TickLayout
from support.feeder import Feeder

CELL = Path(__file__).parents[2] / "service/axisync_service/cells/eod.toml"
PATIENCE_S = 20.0
START_S = 60.0


def wait_for(condition: Callable[[], bool], what: str, seconds: float = PATIENCE_S) -> None:
    """
    Raises:
        TimeoutError: the condition has not come true.
    """
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.005)


class Recording:
    """Shared memory, a ring, a feeder, a log socket, and as many recorder processes, one after another, as wanted."""

    def __init__(self, directory: Path, amplitude: float = 0.2, log_dir: Path | None = None) -> None:
        self.cell, _ = read_cell(CELL)
        self.layout = TickLayout(len(self.cell.axes), len(self.cell.groups))
        self.slots = slots_for(self.cell.period)
        groups = len(self.cell.groups)
        sizes = {
            "control": Control.size(groups),
            "ticks": TickRing.size(self.layout, self.slots),
            "timings": memory.TimingRing.size(),
            "status": memory.STATUS_BYTES,
            "recorder": memory.RECORDER_BYTES,
            "plans": memory.PLAN_SLOTS * memory.PLAN_SLOT_BYTES,
        }
        self.regions = memory.create(sizes)
        self._maps = {name: region.map() for name, region in self.regions.items()}
        self.control = Control(self._maps["control"], groups)
        self.ring = TickRing(self._maps["ticks"], self.layout, self.slots)
        self.plans = self._maps["plans"]
        self.feeder = Feeder(self.cell, self.control, self.ring, amplitude)
        self.log_socket, self._reader = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.run_dir, self.log_dir = directory, log_dir or directory / "logs"
        self.process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process is not None and self.process.poll() is None:
            self.kill()
        self.log_socket.close()
        self._reader.close()
        self.control.close()
        self.ring.close()
        for name, region in self.regions.items():
            self._maps[name].close()
            os.close(region.descriptor)

    def start(self, wait: bool = True, before: Callable[[], None] | None = None) -> "subprocess.Popen[str]":
        """A recorder; `wait`: until it looks after its heartbeat. `before` runs in the child before exec."""
        descriptors = {name: region.descriptor for name, region in self.regions.items()}
        descriptors["log_front"] = self._reader.fileno()
        arguments = ["--cell", str(CELL), "--run-dir", str(self.run_dir), "--log-dir", str(self.log_dir)]
        arguments += ["--listen", "tcp/127.0.0.1:0"]
        arguments += ["--fds", ",".join(f"{name}:{fd}" for name, fd in descriptors.items())]
        self.control[Word.RECORDER_NS] = 0
        self.process = subprocess.Popen(
            [sys.executable, "-W", "error", "-m", "axisync_service.recorder_process", *arguments],
            pass_fds=tuple(descriptors.values()),
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=before,
        )
        if wait:
            wait_for(self._has_begun, "the recorder does not start", START_S)
        return self.process

    def _has_begun(self) -> bool:
        assert self.process is not None
        if self.process.poll() is not None:
            raise RuntimeError(f"the recorder has ended with {self.process.returncode}: {self.ended()[1]}")
        return self.control[Word.RECORDER_NS] > 0

    def send(self, topic: str, data: dict[str, Any], slot: int | None = None, plan_id: int | None = None) -> None:
        """A log entry, as front sends it."""
        entry = LogEntry(topic=topic, log_time_ns=time.monotonic_ns(), data=data, slot=slot, plan_id=plan_id)
        self.log_socket.send(entry.model_dump_json().encode())

    def send_event(self, message: str) -> None:
        """An event of front's."""
        event = {"seq": 0, "source": "front", "kind": "group_state", "message": message, "wall_time": "",
                 "now_s": time.monotonic_ns() / 1e9, "details": {}}  # fmt: skip
        self.send("/events", event)

    def wait_cursor(self, next_tick: int) -> None:
        """Until every tick below `next_tick` has reached the kernel."""
        wait_for(lambda: self.control[Word.RECORDER_CURSOR] >= next_tick, f"the cursor does not reach {next_tick}")

    def kill(self) -> None:
        """kill -9."""
        assert self.process is not None
        self.process.kill()
        self.ended()

    def ended(self) -> tuple[int, str]:
        """Waits for the process to end; exit status and what was said on stderr."""
        assert self.process is not None
        _, said = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, said

    def close(self) -> tuple[int, str]:
        """The phase CLOSING; returns as `ended`."""
        self.control[Word.CONTROLLER_DONE] = 1
        self.control[Word.PHASE] = Phase.CLOSING
        return self.ended()


@contextmanager
def small_disk(directory: Path, megabytes: int) -> Iterator[Path]:
    """A tmpfs of this size.

    Raises:
        PermissionError: this user may not mount.
    """
    directory.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "axisync-test", str(directory)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        raise PermissionError("tmpfs cannot be mounted")
    try:
        yield directory
    finally:
        subprocess.run(["umount", "--lazy", str(directory)], check=True, capture_output=True)
