"""Load beside the service: stress-ng, where it is installed."""

import shutil
import subprocess
from types import TracebackType
from typing import Self

LOADS = {
    "cpu": ("--cpu", "0"),
    "memory": ("--vm", "2", "--vm-bytes", "256M"),
    "io": ("--hdd", "1", "--hdd-bytes", "64M", "--io", "1"),
    "all": ("--cpu", "0", "--vm", "1", "--vm-bytes", "256M", "--io", "1"),
}


class Stress:
    """One of LOADS for the length of a block; None: none.

    Raises:
        RuntimeError: stress-ng is not installed.
    """

    def __init__(self, load: str | None) -> None:
        if load is not None and shutil.which("stress-ng") is None:
            raise RuntimeError("there is no stress-ng (Debian: apt install stress-ng)")
        self._load = load
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        if self._load is not None:
            self._process = subprocess.Popen(
                ["stress-ng", "--quiet", "--temp-path", "/tmp", *LOADS[self._load]], stdin=subprocess.DEVNULL
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.wait()
