"""A new file whose every write goes to the kernel at once, so that `position` says what a killed process leaves."""

import os
from pathlib import Path


class KernelFile:
    """Write-only, unbuffered, sequential; the part of a binary stream that the MCAP writer uses."""

    def __init__(self, path: Path) -> None:
        """
        Raises:
            FileExistsError: never overwrites.
            OSError: the file cannot be made.
        """
        self.path = path
        self.position = 0
        self._synced = 0
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)

    def write(self, data: bytes | memoryview) -> int:
        """Writes all of it.

        Raises:
            OSError: full disk, file size limit, input/output error; part of it may have been written.
        """
        view = memoryview(data)
        while view:
            done = os.write(self._fd, view)
            self.position += done
            view = view[done:]
        return len(data)

    def fileno(self) -> int:
        """Its descriptor."""
        return self._fd

    def tell(self) -> int:
        """Bytes written so far."""
        return self.position

    def flush(self) -> None:
        """Nothing is held back."""

    def sync(self) -> None:
        """Has the kernel bring what was written to the disk, if there is anything new.

        Raises:
            OSError: it could not.
        """
        if self._synced != self.position:
            self._synced = self.position
            os.fdatasync(self._fd)

    def cut(self, size: int) -> None:
        """Drops a torn end; the file has `size` bytes afterwards.

        Raises:
            OSError: it could not.
        """
        os.ftruncate(self._fd, size)
        self.position = size

    def close(self) -> None:
        """Closes the file; twice does no harm."""
        if self._fd >= 0:
            fd, self._fd = self._fd, -1
            os.close(fd)


def sync_directory(directory: Path) -> None:
    """Makes a new file's name as durable as its contents."""
    fd = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
