"""Where there is neither cyclictest nor a C compiler: `reference.c` in Python. Arguments: PERIOD_NS TICKS."""

import ctypes
import gc
import sys
import time

_CLOCK_MONOTONIC, _TIMER_ABSTIME = 1, 1


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


def main(period_ns: int, ticks: int) -> None:
    libc = ctypes.CDLL(None)
    libc.mlockall(3)
    gc.disable()
    late = [0] * ticks
    due_ns = time.monotonic_ns()
    for i in range(ticks):
        due_ns += period_ns
        due = _Timespec(*divmod(due_ns, 1_000_000_000))
        libc.clock_nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, ctypes.byref(due), None)
        late[i] = time.monotonic_ns() - due_ns
    print("\n".join(map(str, late)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
