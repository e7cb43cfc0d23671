"""One daemon a cell, one daemon a bus: advisory locks that end with the process."""

import errno
import fcntl
import os
from pathlib import Path

from axisync_schemas.cell import Cell


class CannotRun(Exception):
    """The service cannot run here; one sentence with what to do."""


class Locked(CannotRun):
    """Somebody else holds it; one sentence with who."""


def runtime_directory() -> Path:
    """Where locks and sockets live: the user's runtime directory, or a private one in /tmp.

    Raises:
        CannotRun: it cannot be made or written, or is another user's.
    """
    base = os.environ.get("XDG_RUNTIME_DIR")
    directory = Path(base, "axisync") if base else Path(f"/tmp/axisync-{os.getuid()}")
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        owner = directory.stat().st_uid
        if not os.access(directory, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise CannotRun(f"{directory}: {error.strerror}: set XDG_RUNTIME_DIR to a directory of yours") from None
    if owner != os.getuid():
        raise CannotRun(f"{directory} belongs to another user: remove it, or set XDG_RUNTIME_DIR")
    return directory


class Locks:
    """Locks on a cell's name and on each of its buses; held until `release` or the end of the process."""

    def __init__(self, cell: Cell) -> None:
        """
        Raises:
            Locked: another daemon serves this cell or one of its buses.
        """
        self._files: list[int] = []
        names = [(f"cell {cell.name}", f"cell-{cell.name}")]
        names += [
            (f"bus {bus.channel}", f"bus-{bus.channel.replace('/', '_')}")
            for bus in cell.buses
            if bus.interface == "socketcan"  # a simulated bus lives in a directory of its own
        ]
        for what, name in names:
            self._take(what, runtime_directory() / f"{name}.lock")

    def _take(self, what: str, path: Path) -> None:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.read(descriptor, 32).decode(errors="replace").strip()
            os.close(descriptor)
            self.release()
            raise Locked(f"{what} is already served by process {holder or 'unknown'}: stop that daemon first") from None
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"{os.getpid()}\n".encode())
        self._files.append(descriptor)

    def release(self) -> None:
        """Lets go of all of them."""
        while self._files:
            os.close(self._files.pop())
