"""What only Linux has: timers that fire in time, children that die with their parent, signals that end a select."""

import ctypes
import os
import signal
import socket
from types import FrameType

_PR_SET_PDEATHSIG = 1
_PR_SET_TIMERSLACK = 29
_libc = ctypes.CDLL(None, use_errno=True)


def precise_timers() -> None:
    """Sleeps and selects of this thread end when they should, not up to 50 us later (timer slack 1 ns)."""
    _libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)


def real_time_priority(priority: int) -> bool:
    """SCHED_FIFO at this priority for this process; False where that is not permitted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def die_with_parent() -> bool:
    """SIGTERM when the parent's thread that started this process ends; False where it has ended already."""
    parent = os.getppid()
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    return parent == os.getppid()


class StopRequest:
    """Set by SIGTERM and SIGINT; readable for select once it is set."""

    def __init__(self) -> None:
        self.requested = False
        self._reader, self._writer = socket.socketpair()
        self._reader.setblocking(False)
        self._writer.setblocking(False)

    def install(self) -> None:
        """From now on the signals ask for a stop."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)

    def set(self) -> None:
        """Asks for a stop."""
        self.requested = True
        self._writer.send(b"\0")

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if not self.requested:
            self.set()

    def fileno(self) -> int:
        """For select."""
        return self._reader.fileno()

    def close(self) -> None:
        """Frees its sockets."""
        self._reader.close()
        self._writer.close()
