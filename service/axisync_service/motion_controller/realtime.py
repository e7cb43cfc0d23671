"""What makes a Python process keep time where it may: SCHED_FIFO, locked memory, CPUs awake, no garbage collection."""

import ctypes
import gc
import os
import struct
from pathlib import Path

PRIORITY = 80
CPU_LATENCY = Path("/dev/cpu_dma_latency")
"""While somebody keeps it open, no CPU sleeps deeper than the number written to it allows (the kernel's PM QoS)."""
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4  # on fault: plan slots that are never used take no memory


def permitted() -> bool:
    """This process, and so its children, may take real-time scheduling."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    if _schedule() is not None:
        return False
    os.sched_setscheduler(0, *before)
    return True


def enter() -> str | None:
    """Takes real-time scheduling, locks memory, keeps CPUs awake. Returns one sentence that names what is missing.

    None where nothing is. That CPUs may sleep is not said: not all do, `axisyncd doctor` knows. Call when every thread
    of the process is started: threads inherit SCHED_FIFO.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    keep_awake()
    missing = [what for what in (_schedule(), _lock_memory()) if what]
    return " and ".join(missing) if missing else None


def keep_awake(device: Path = CPU_LATENCY) -> bool:
    """Until this process ends, CPUs sleep no deeper than they wake from at once; False where that is not permitted."""
    try:
        kept = os.open(device, os.O_WRONLY | os.O_CLOEXEC)  # closing it would end it
    except OSError:
        return False
    os.write(kept, struct.pack("=i", 0))
    return True


def _schedule() -> str | None:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        return "SCHED_FIFO (CAP_SYS_NICE or an rtprio limit of 80)"
    return None


def _lock_memory() -> str | None:
    if ctypes.CDLL(None, use_errno=True).mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) != 0:
        return "locked memory (CAP_IPC_LOCK or an unlimited memlock limit)"
    return None
