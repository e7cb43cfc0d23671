"""How fast `axisync review` is on a long log, beside a plain loop that decodes every message; needs no service."""

import subprocess
import sys
import time
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import review_log
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from report import Report

TICKS = 1_800_000
"""An hour at 500 Hz."""
PLAIN_TICKS = 60_000
"""The plain loop runs over a part; an hour would take minutes."""
CELL = Path(__file__).parents[2] / "service/axisync_service/cells/eod.toml"
LAUNCHER = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], check=False).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss, file=sys.stderr)
sys.exit(code)
"""
"""A small process in between: the peak of a child counts what its parent had when it was forked."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one program: wall and CPU time, s, and the most memory that it had, MiB."""

    wall_s: float
    cpu_s: float
    memory_mib: float


def measure(report: Report, directory: Path, ticks: int = TICKS, plain_ticks: int = PLAIN_TICKS) -> None:
    """Writes a log, reviews it, decodes a part of it, prints.

    Raises:
        RuntimeError: the review fails, or finds the log not to be good.
    """
    report.say(f"writing a log of {ticks:,} ticks of 12 axes")
    path = review_log.write(directory, CELL, ticks)
    report.say(f"reviewing it, {path.stat().st_size / 1e6:,.0f} MB")
    cost = reviewed(path)
    plain_s, plain_cpu_s = (seconds / plain_ticks for seconds in plain(path, plain_ticks))
    ratio, cpu_ratio = plain_s / (cost.wall_s / ticks), plain_cpu_s / (cost.cpu_s / ticks)
    report.say(
        f"review of {ticks * 0.002 / 60:.3g} min: {cost.wall_s:.1f} s, {cost.cpu_s:.1f} s of CPU, "
        f"{cost.memory_mib:.0f} MiB; the plain loop takes {plain_s * 1e6:.1f} us a tick, {plain_s * ticks:.0f} s: "
        f"{ratio:.1f} times as long, {cpu_ratio:.1f} times the CPU"
    )
    report.data["review"] = {
        "ticks": ticks,
        "wall_s": cost.wall_s,
        "cpu_s": cost.cpu_s,
        "memory_mib": cost.memory_mib,
        "plain_us_a_tick": plain_s * 1e6,
        "ratio": ratio,
        "cpu_ratio": cpu_ratio,
    }


def reviewed(path: Path) -> Cost:
    """What the command line costs, the start of Python included."""
    begin = time.perf_counter()
    command = [sys.executable, "-c", LAUNCHER, sys.executable, "-m", "axisync_cli", "review", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall_s = time.perf_counter() - begin
    if done.returncode != 0:
        raise RuntimeError(f"the review failed: {[*done.stdout.splitlines(), done.returncode][-1]}")
    cpu_s, memory_kib = map(float, done.stderr.splitlines()[-1].split())
    return Cost(wall_s, cpu_s, memory_kib / 1024)


def plain(path: Path, ticks: int) -> tuple[float, float]:
    """Wall and CPU seconds for decoding `ticks` messages one after the other, and looking at one field of each."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        begin, begin_cpu, peak = time.perf_counter(), time.process_time(), 0.0
        for _, _, _, tick in islice(reader.iter_decoded_messages(topics=["/setpoints"]), ticks):
            peak = max(peak, tick.velocity[0])
        return time.perf_counter() - begin, time.process_time() - begin_cpu


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory(prefix="axisync-bench-") as folder:
        measure(Report(), Path(folder), *map(int, sys.argv[1:]))
