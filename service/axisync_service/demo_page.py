"""The web page beside the demo: `axisync-dashboard` as a process of its own, where it is installed."""

import contextlib
import importlib.util
import subprocess
import sys
from dataclasses import dataclass

END_S = 5.0


@dataclass(slots=True)
class Page:
    """Started when the service is ready; says its address itself."""

    endpoint: str
    port: int
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Out of reach of Ctrl-C, so that people see the arms stop."""
        if any(importlib.util.find_spec(name) is None for name in ("axisync_dashboard", "nicegui")):
            print("No web page: NiceGUI is not installed (pip install 'axisync[dashboard]').", flush=True)
            return
        command = [sys.executable, "-m", "axisync_dashboard", "--endpoint", self.endpoint, "--port", str(self.port)]
        self.process = subprocess.Popen(
            [*command, "--die-with-parent"], stdin=subprocess.DEVNULL, start_new_session=True
        )

    def stop(self) -> None:
        """Ends it."""
        if self.process is None:
            return
        self.process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(END_S)
        self.process.kill()
        self.process.wait()
