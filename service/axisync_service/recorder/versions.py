"""What made a log: versions of Python, of axisync, of its libraries and of the kernel."""

import json
import platform
from importlib import metadata

PACKAGES = ("axisync", "canopen", "eclipse-zenoh", "mcap", "numpy", "pin", "protobuf", "pydantic", "python-can")


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
