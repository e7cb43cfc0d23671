"""The four processes: started by exec from the main thread, watched, restarted within bounds."""

import os
import signal
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass, field

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""numpy starts no threads of its own: none may run beside the cycle."""
RESTARTS_MAX = 5
RESTARTS_WINDOW_S = 60.0

MODULES = {
    "recorder": "axisync_service.recorder_process",
    "controller": "axisync_service.controller",
    "planner": "axisync_service.planner_worker",
    "front": "axisync_service.front",
}
"""Started in this order: what a process needs is there before it."""


@dataclass(slots=True)
class Child:
    """One process of the service."""

    name: str
    arguments: list[str]
    descriptors: dict[str, int]
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Spawns it. Call from the main thread: its parent-death signal fires when the spawning thread ends."""
        fds = ",".join(f"{name}:{fd}" for name, fd in self.descriptors.items())
        command = [sys.executable, "-m", MODULES[self.name], *self.arguments, "--fds", fds]
        self.process = subprocess.Popen(
            command,
            pass_fds=tuple(self.descriptors.values()),
            stdin=subprocess.DEVNULL,
            env={**os.environ, **ONE_THREAD},
        )

    @property
    def pid(self) -> int:
        """Its process id, 0 before it was started."""
        return self.process.pid if self.process else 0

    def ended(self) -> int | None:
        """Its exit code, negative for a signal; None while it runs."""
        return self.process.poll() if self.process else None

    def kill(self) -> None:
        """SIGKILL, if it still runs."""
        if self.process is not None and self.process.poll() is None:
            self.process.kill()

    def wait(self, seconds: float) -> bool:
        """True when it has ended within `seconds`."""
        if self.process is None:
            return True
        try:
            self.process.wait(max(0.0, seconds))
        except subprocess.TimeoutExpired:
            return False
        return True


@dataclass(slots=True)
class Restarts:
    """At most `RESTARTS_MAX` in `RESTARTS_WINDOW_S`."""

    times: deque[float] = field(default_factory=deque)

    def allowed(self, now_s: float | None = None) -> bool:
        """Counts one more restart; False when there were too many."""
        now = time.monotonic() if now_s is None else now_s
        while self.times and now - self.times[0] > RESTARTS_WINDOW_S:
            self.times.popleft()
        self.times.append(now)
        return len(self.times) <= RESTARTS_MAX


def describe_exit(code: int) -> str:
    """An exit code in words."""
    if code < 0:
        return f"killed by {signal.Signals(-code).name}"
    return f"ended with exit code {code}"
