"""What made a log: axisync and its libraries, the machine and its kernel."""

import json
import os
import platform
import socket
from importlib import metadata
from pathlib import Path

PACKAGES = (
    "axisync", "canopen", "coal", "eclipse-zenoh", "mcap", "numba", "numpy", "pin", "protobuf", "pydantic",
    "python-can", "zstandard",
)  # fmt: skip
_REALTIME = Path("/sys/kernel/realtime")


def versions() -> dict[str, str]:
    """By name; a package that is not installed is left out. Reads package data, imports nothing."""
    found = {"python": platform.python_version(), "kernel": platform.release(), "machine": platform.machine()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def versions_json() -> bytes:
    """The attachment `versions.json`."""
    return json.dumps(versions(), indent=1, sort_keys=True).encode()


def machine() -> dict[str, str]:
    """The metadata record `axisync.machine`: where it ran, and whether its kernel keeps time."""
    return {
        "hostname": socket.gethostname(),
        "kernel": platform.release(),
        "kernel_version": platform.version(),
        "kernel_realtime": "yes" if _preemptible() else "no",
        "processors": str(os.cpu_count() or 0),
        "python": platform.python_version(),
    }


def _preemptible() -> bool:
    """A PREEMPT_RT kernel says so in /sys/kernel/realtime, or at least in its version."""
    try:
        return _REALTIME.read_text(encoding="ascii").strip() == "1"
    except OSError:
        return "PREEMPT_RT" in platform.version()
