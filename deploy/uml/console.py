"""What the guest's console says: boot messages, then the command's output between two marks, then its exit code."""

import re

BEGIN = b"\x1eAXISYNC-UML-BEGIN\n"
"""Printed by the guest before the command starts. The record separator does not occur in sane output."""
END = re.compile(rb"\x1eAXISYNC-UML-END (\d+)\n")
"""Printed after the command ended; the number is its exit code, 128 + n where signal n killed it."""
_LONGEST_MARK = 32


class Console:
    """Splits the console's bytes, which arrive in any pieces."""

    def __init__(self) -> None:
        self.boot = bytearray()
        self.exit_code: int | None = None
        self.begun = False
        self._pending = bytearray()

    def feed(self, data: bytes) -> bytes:
        """Takes what the console printed; returns what of it the command printed. After the end, nothing."""
        self._pending += data
        if not self.begun:
            self._boot()
        if not self.begun or self.exit_code is not None:
            return b""
        end = END.search(self._pending)
        if end is not None:
            self.exit_code = int(end[1])
            return self._take(end.start())
        return self._take(self._certain())

    def _boot(self) -> None:
        before, mark, after = bytes(self._pending).partition(BEGIN)
        if mark:
            self.begun = True
            self.boot += before
            self._pending[:] = after

    def _certain(self) -> int:
        """How many pending bytes cannot be the beginning of the end mark."""
        mark = self._pending.rfind(b"\x1e")
        unfinished = mark >= 0 and len(self._pending) - mark < _LONGEST_MARK
        return mark if unfinished else len(self._pending)

    def _take(self, count: int) -> bytes:
        taken = bytes(self._pending[:count])
        del self._pending[:count]
        return taken

    def unread(self) -> str:
        """Boot messages and what follows them without a mark: what to show where the guest did not get to its end."""
        return bytes(self.boot + self._pending).decode(errors="replace")
