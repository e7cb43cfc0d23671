"""What this machine's timers can do at best: cyclictest, or the same loop in C or Python, beside the service."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from percentiles import Distribution

HERE = Path(__file__).parent
HISTOGRAM_US = 100_000
"""Later wake-ups are in cyclictest's overflow count and its maximum only."""


@dataclass(frozen=True, slots=True)
class Scheduling:
    """How a process is scheduled: policy, priority, CPUs. The reference gets the controller's."""

    policy: int
    priority: int
    cpus: frozenset[int]

    @classmethod
    def of(cls, pid: int) -> "Scheduling":
        """That of a running process."""
        priority = os.sched_getparam(pid).sched_priority
        return cls(os.sched_getscheduler(pid), priority, frozenset(os.sched_getaffinity(pid)))

    @property
    def realtime(self) -> bool:
        """Under SCHED_FIFO or SCHED_RR."""
        return self.policy in (os.SCHED_FIFO, os.SCHED_RR)

    def beside(self) -> "Scheduling":
        """For a process beside it: the same, but on the other CPUs where it has one of its own."""
        others = frozenset(os.sched_getaffinity(0)) - self.cpus
        return Scheduling(self.policy, self.priority, others) if len(self.cpus) == 1 and others else self

    def words(self) -> str:
        """For a table's note."""
        return f"SCHED_FIFO {self.priority}" if self.realtime else "without real-time priority"

    def apply(self) -> None:
        """To this process."""
        os.sched_setaffinity(0, self.cpus)
        os.sched_setscheduler(0, self.policy, os.sched_param(self.priority))


class Reference:
    """A reference loop that runs in the background from construction on."""

    def __init__(self, period_s: float, seconds: float, scheduling: Scheduling) -> None:
        self.scheduling = scheduling
        self.seconds = seconds
        period_ns, ticks = round(period_s * 1e9), max(1, round(seconds / period_s))
        self.name, command = _command(period_ns, ticks, scheduling)
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=None if self.name == "cyclictest" else scheduling.apply,
        )

    def result(self) -> Distribution:
        """Waits for the end; lateness in microseconds.

        Raises:
            RuntimeError: it failed, with what it said.
        """
        try:
            output, errors = self._process.communicate(timeout=self.seconds + 30.0)
        except subprocess.TimeoutExpired:
            self.stop()
            raise RuntimeError(f"{self.name} did not end") from None
        if self._process.returncode != 0:
            raise RuntimeError(f"{self.name} failed: {errors.strip()[-500:]}")
        if self.name == "cyclictest":
            return parse_cyclictest(output)
        return Distribution.of([int(line) / 1e3 for line in output.split()])

    def stop(self) -> None:
        """Ends it early; may be called at any time."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()


def bare_cycle(period_s: float, seconds: float, scheduling: Scheduling, buses: int, drives: int) -> Distribution:
    """Microseconds of a cycle that only sends and receives the frames of `buses` with so many drives each.

    Raises:
        RuntimeError: it failed, with what it said.
    """
    numbers = (round(period_s * 1e9), max(1, round(seconds / period_s)), buses, drives)
    done = subprocess.run(
        [sys.executable, str(HERE / "bare_cycle.py"), *map(str, numbers)],
        capture_output=True, text=True, check=False, timeout=seconds + 30.0, preexec_fn=scheduling.apply,
    )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(f"the bare cycle failed: {done.stderr.strip()[-500:]}")
    return Distribution.of([int(line) / 1e3 for line in done.stdout.split()])


def _command(period_ns: int, ticks: int, scheduling: Scheduling) -> tuple[str, list[str]]:
    """The best there is here: its name and its command line."""
    if shutil.which("cyclictest"):
        return "cyclictest", _cyclictest(period_ns, ticks, scheduling)
    if compiled := _compiled():
        return "C loop", [str(compiled), str(period_ns), str(ticks)]
    return "Python loop", [sys.executable, str(HERE / "reference_loop.py"), str(period_ns), str(ticks)]


def _cyclictest(period_ns: int, ticks: int, scheduling: Scheduling) -> list[str]:
    """--default-system: it must not change the machine's power states under the service that it is compared with."""
    policy = ["--policy=fifo", f"--priority={scheduling.priority}"] if scheduling.realtime else ["--policy=other"]
    lock = ["--mlockall"] if os.geteuid() == 0 else []
    cpus = ",".join(map(str, sorted(scheduling.cpus)))
    return [
        "taskset", "--cpu-list", cpus, "cyclictest", "--threads=1", f"--interval={period_ns // 1000}",
        f"--loops={ticks}", f"--histogram={HISTOGRAM_US}", "--quiet", "--default-system", *lock, *policy,
    ]  # fmt: skip


def _compiled() -> Path | None:
    """`reference.c` as a program in the user's cache, or None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "axisync"
    program = cache / "reference"
    try:
        cache.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [compiler, "-O2", "-o", str(program), str(HERE / "reference.c")], check=True, capture_output=True
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return program


def parse_cyclictest(output: str) -> Distribution:
    """Microseconds, from the output of `--histogram --quiet` with one thread.

    Wake-ups beyond the histogram are counted at the maximum, which is the one of them that is known.

    Raises:
        RuntimeError: no such output.
    """
    rows = re.findall(r"^(\d+)\s+(\d+)\s*$", output, re.MULTILINE)
    maximum = re.search(r"^# Max Latencies: *(\d+)", output, re.MULTILINE)
    overflows = re.search(r"^# Histogram Overflows: *(\d+)", output, re.MULTILINE)
    if not rows or maximum is None:
        raise RuntimeError(f"cyclictest printed no histogram: {output[-500:]}")
    histogram = {float(value): int(count) for value, count in rows}
    if overflows is not None and int(overflows[1]):
        latest = float(maximum[1])
        histogram[latest] = histogram.get(latest, 0) + int(overflows[1])
    return Distribution.of_histogram(histogram)
