"""What the facts mean for the cycle, and what to change. Pure."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from axisync_service.doctor.facts import CanInterface, Facts
from axisync_service.doctor.latency import Latency
from axisync_service.motion_controller.realtime import CPU_LATENCY, PRIORITY

MEMORY_LOCKED = 512 * 2**20
"""Bytes: the controller with everything it maps."""
GOOD_CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page")
"""Read without entering the kernel; hpet or acpi_pm take microseconds each time."""
SLOW_GOVERNORS = ("powersave", "conservative", "ondemand")
SLEEP_US_MAX = 20
"""Waking up takes so long anyway."""
RT_SHARE_MIN = 0.9
QUEUE_MIN = 64
"""Frames: one cycle of a full bus, heartbeats and SDO besides."""
LATE_SHARE, SKIPPED_SHARE = 0.10, 0.001
"""Of a period, p99; of all ticks. More endangers the cycle."""
LATEST_SHARE = 0.5
"""Of a period: single wake-ups later than this deserve a word."""


class Level(StrEnum):
    """How grave."""

    OK = "ok"
    ADVICE = "advice"
    DANGER = "danger"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the verdict; `fix`: what to change."""

    what: str
    level: Level
    says: str
    fix: str | None = None


def findings(facts: Facts, latency: Latency | None = None) -> list[Finding]:
    """In the order in which one would mend them."""
    found = [*_permissions(facts), *_kernel(facts), *_processor(facts), *map(_can, facts.can)]
    if not facts.can:
        found.append(Finding("CAN", Level.OK, "no interface; the demo simulates its buses"))
    return found + ([_latency(latency)] if latency is not None else [])


def dangerous(found: list[Finding]) -> bool:
    """Something would endanger the cycle."""
    return any(finding.level is Level.DANGER for finding in found)


def _permissions(facts: Facts) -> Iterator[Finding]:
    limits = "rtprio 80 and memlock unlimited in /etc/security/limits.d (deploy/realtime.md)"
    if facts.may_fifo:
        yield Finding("real-time priority", Level.OK, f"SCHED_FIFO {PRIORITY} is permitted")
    else:
        says = f"not permitted: the rtprio limit is {facts.rtprio}, {PRIORITY} is needed"
        yield Finding("real-time priority", Level.DANGER, says, f"{limits}, or CAP_SYS_NICE")
    if facts.privileged or facts.memlock < 0 or facts.memlock >= MEMORY_LOCKED:
        yield Finding("locked memory", Level.OK, "permitted")
    else:
        says = f"not permitted: the memlock limit is {facts.memlock // 1024} KiB"
        yield Finding("locked memory", Level.DANGER, says, f"{limits}, or CAP_IPC_LOCK")
    if facts.rt_share < RT_SHARE_MIN:
        says = f"real-time processes may take {facts.rt_share:.0%} of the time, then they are stopped"
        yield Finding("throttling", Level.DANGER, says, "sysctl kernel.sched_rt_runtime_us=950000")


def _kernel(facts: Facts) -> Iterator[Finding]:
    where = f"Linux {facts.kernel}, {facts.preemption or 'no preemption'}"
    if facts.preemption == "PREEMPT_RT":
        yield Finding("kernel", Level.OK, where)
    elif facts.preemption:
        yield Finding("kernel", Level.ADVICE, where + ": single wake-ups may be milliseconds late",
                      "a PREEMPT_RT kernel (Debian: linux-image-rt-amd64)")  # fmt: skip
    else:
        yield Finding("kernel", Level.DANGER, where, "a kernel built with PREEMPT_RT, or at least PREEMPT_DYNAMIC")
    if facts.clock_source in GOOD_CLOCKS:
        yield Finding("clock source", Level.OK, facts.clock_source)
    else:
        says = f"{facts.clock_source or 'unknown'}: each look at the time is a slow one"
        yield Finding("clock source", Level.DANGER, says, "boot with clocksource=tsc tsc=reliable, if the CPU has it")


def _processor(facts: Facts) -> Iterator[Finding]:
    slow = [governor for governor in facts.governors if governor in SLOW_GOVERNORS]
    if slow:
        yield Finding("CPU governor", Level.ADVICE, f"{', '.join(slow)}: wake-ups wait for the clock to rise",
                      "cpupower frequency-set -g performance")  # fmt: skip
    else:
        yield Finding("CPU governor", Level.OK, ", ".join(facts.governors) or "none, the clock is fixed or the host's")
    if facts.sleep_us <= SLEEP_US_MAX:
        yield Finding("CPU sleep", Level.OK, f"wakes within {facts.sleep_us} us" if facts.sleep_us else "none")
    elif facts.may_keep_awake:
        yield Finding("CPU sleep", Level.OK, f"up to {facts.sleep_us} us to wake, but not while the controller runs")
    else:
        fix = f"let its user write {CPU_LATENCY} (deploy/realtime.md), or boot with processor.max_cstate=1"
        yield Finding("CPU sleep", Level.ADVICE, f"it takes up to {facts.sleep_us} us to wake from it", fix)
    if facts.isolated:
        yield Finding("CPU isolation", Level.OK, f"CPU {facts.isolated}")
    else:
        fix = "boot with isolcpus=3 nohz_full=3, and keep interrupts away (deploy/realtime.md)"
        yield Finding("CPU isolation", Level.ADVICE, f"none of {facts.cpus} CPUs", fix if facts.cpus > 2 else None)
    busy = facts.load > facts.cpus
    says = f"{facts.cpus} for this process, load {facts.load:.1f}" + (", a virtual machine" if facts.virtual else "")
    level = Level.ADVICE if busy or facts.virtual or facts.cpus < 2 else Level.OK
    change = "stop other work" if busy else "a machine of its own" if level is Level.ADVICE else None
    yield Finding("CPUs", level, says, change)


def _can(interface: CanInterface) -> Finding:
    what, bad = f"CAN {interface.name}", Level.DANGER if interface.wanted else Level.ADVICE
    if not interface.there:
        return Finding(what, bad, "the cell file wants it, the kernel has none", f"deploy/vcan.sh {interface.name}, "
                       "or the driver of the adapter")  # fmt: skip
    if not interface.up:
        return Finding(what, bad, "down", f"ip link set {interface.name} up type can bitrate 1000000")
    if interface.queue < QUEUE_MIN and not interface.name.startswith("vcan"):
        return Finding(what, Level.ADVICE, f"up, its queue holds {interface.queue} frames",
                       f"ip link set {interface.name} txqueuelen 128")  # fmt: skip
    return Finding(what, Level.OK, "up")


def _latency(latency: Latency) -> Finding:
    period = latency.period_us
    says = (
        f"{latency.ticks} ticks of {period / 1e3:g} ms: p50 {latency.p50_us:.0f} us, p99 {latency.p99_us:.0f} us, "
        f"max {latency.max_us:.0f} us, {latency.skipped} skipped, {latency.most_skipped} in a row at most"
    )
    fix = "what is listed above, or nothing else on this machine; stress it and try again"
    late = latency.p99_us > LATE_SHARE * period or latency.skipped > SKIPPED_SHARE * latency.ticks
    if late or latency.most_skipped > latency.skipped_max:
        return Finding("latency", Level.DANGER, says, fix)
    if latency.max_us > LATEST_SHARE * period:
        return Finding("latency", Level.ADVICE, says, fix)
    return Finding("latency", Level.OK, says)
