"""What this machine is, as far as it matters for a loop that must be on time. Only reads."""

import os
import platform
import re
import resource
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from axisync_service.motion_controller import realtime

PROC, SYS = Path("/proc"), Path("/sys")
_CPU = "devices/system/cpu"
_CLOCK = "devices/system/clocksource/clocksource0/current_clocksource"
IFF_UP = 1


@dataclass(frozen=True, slots=True)
class CanInterface:
    """A CAN interface of the kernel, or one that the cell file wants. `queue`: frames, its txqueuelen."""

    name: str
    there: bool
    up: bool
    queue: int = 0
    wanted: bool = False


@dataclass(frozen=True, slots=True)
class Facts:
    """One machine, now.

    Attributes:
        preemption: of the kernel's build: "PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT", or "".
        may_fifo: SCHED_FIFO was tried and granted. rtprio, memlock: limits; -1 is unlimited.
        privileged: locks any amount of memory whatever the limit.
        rt_share: of each second that real-time processes may take; 1 without a limit.
        governors: of the CPUs that tell one. isolated: as the kernel's command line has it, "" none.
        sleep_us: what it takes to wake from the deepest sleep, 0 where CPUs do not sleep.
        may_keep_awake: the controller may forbid such sleep.
        load: processes that run or want to, over the last minute.
    """

    kernel: str
    preemption: str
    cpus: int
    may_fifo: bool
    rtprio: int
    memlock: int
    privileged: bool
    rt_share: float
    governors: tuple[str, ...]
    sleep_us: int
    may_keep_awake: bool
    isolated: str
    clock_source: str
    load: float
    virtual: bool
    can: tuple[CanInterface, ...]


def gather(wanted: Sequence[str] = (), proc: Path = PROC, sys: Path = SYS) -> Facts:
    """Reads everything; `wanted`: channels of the cell's socketcan buses."""
    rtprio, memlock = (resource.getrlimit(which)[0] for which in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK))
    governors = {_text(file) for file in (sys / _CPU).glob("cpu[0-9]*/cpufreq/scaling_governor")}
    return Facts(
        kernel=platform.release(),
        preemption=preemption(platform.version(), _text(sys / "kernel/realtime")),
        cpus=len(os.sched_getaffinity(0)),
        may_fifo=realtime.permitted(),
        rtprio=rtprio,
        memlock=memlock,
        privileged=_may_lock(_text(proc / "self/status")),
        rt_share=_rt_share(proc / "sys/kernel"),
        governors=tuple(sorted(governors)),
        sleep_us=deepest_sleep_us(sys / _CPU),
        may_keep_awake=os.access(realtime.CPU_LATENCY, os.W_OK),
        isolated=_text(sys / _CPU / "isolated"),
        clock_source=_text(sys / _CLOCK),
        load=os.getloadavg()[0],
        virtual="hypervisor" in _text(proc / "cpuinfo"),
        can=can_interfaces(wanted, sys / "class/net"),
    )


def preemption(version: str, realtime_flag: str) -> str:
    """Of the kernel's build line, "#1 SMP PREEMPT_DYNAMIC ...", and of /sys/kernel/realtime."""
    found = re.search(r"PREEMPT\w*", version)
    return "PREEMPT_RT" if realtime_flag == "1" else found[0] if found else ""


def deepest_sleep_us(cpus: Path) -> int:
    """The longest exit latency of the idle states that are not switched off."""
    states = [state for state in cpus.glob("cpu[0-9]*/cpuidle/state[0-9]*") if _text(state / "disable") != "1"]
    return max((int(_text(state / "latency") or "0") for state in states), default=0)


def can_interfaces(wanted: Sequence[str], net: Path) -> tuple[CanInterface, ...]:
    """Those of the kernel (ARPHRD_CAN is 280), and those that are wanted and missing."""
    there = sorted(entry.name for entry in net.iterdir() if _text(entry / "type") == "280") if net.exists() else []
    found = [
        CanInterface(
            name, True, bool(int(_text(net / name / "flags") or "0", 16) & IFF_UP),
            int(_text(net / name / "tx_queue_len") or "0"), name in wanted,
        )
        for name in there
    ]  # fmt: skip
    return (*found, *(CanInterface(name, False, False, wanted=True) for name in wanted if name not in there))


def _may_lock(status: str) -> bool:
    """CAP_IPC_LOCK, bit 14 of the effective set."""
    found = re.search(r"^CapEff:\s*([0-9a-f]+)", status, re.MULTILINE)
    return bool(found and int(found[1], 16) >> 14 & 1)


def _rt_share(kernel: Path) -> float:
    runtime, period = _text(kernel / "sched_rt_runtime_us"), _text(kernel / "sched_rt_period_us")
    if not runtime or not period or int(runtime) < 0:
        return 1.0
    return int(runtime) / int(period)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
