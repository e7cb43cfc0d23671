"""What is kept of a cell's logs: finished files and extracts up to a total size; the oldest go first."""

import contextlib
import fcntl
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from axisync_service.recorder.names import FAULTS, LogName


@dataclass(frozen=True, slots=True)
class Kept:
    """A log file of the cell."""

    name: LogName
    path: Path
    size: int


def log_files(directory: Path, cell: str) -> list[Kept]:
    """The cell's log files and extracts, oldest first: regular files with names of ours, no links."""
    found = [*_in(directory, cell, extracts=False), *_in(directory / FAULTS, cell, extracts=True)]
    return sorted(found, key=lambda kept: kept.name)


def _in(directory: Path, cell: str, extracts: bool) -> Iterator[Kept]:
    try:
        entries = list(os.scandir(directory))
    except OSError:
        return
    for entry in entries:
        name = LogName.parse(cell, entry.name)
        if name is None or bool(name.fault) is not extracts:
            continue
        with contextlib.suppress(OSError):
            status = entry.stat(follow_symlinks=False)
            if stat.S_ISREG(status.st_mode):
                yield Kept(name, Path(entry.path), status.st_size)


def surplus(files: list[Kept], limit: float) -> list[Kept]:
    """The oldest ones without which the others fit `limit` bytes; never the newest."""
    total = sum(kept.size for kept in files)
    over = []
    for kept in files[:-1]:
        if total <= limit:
            break
        over.append(kept)
        total -= kept.size
    return over


def tidy(directory: Path, cell: str, limit: float) -> list[Kept]:
    """Deletes what is too much, except what somebody writes; returns what was deleted."""
    return [kept for kept in surplus(log_files(directory, cell), limit) if _delete(kept.path)]


def _delete(path: Path) -> bool:
    """False where a recorder holds it open for writing (its lock says so), or it cannot be deleted."""
    try:
        fd = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()
    except OSError:
        return False
    finally:
        os.close(fd)
    return True
