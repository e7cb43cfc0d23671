"""What the log costs: the recorder's real process on 500 ticks a second, standing still and with every axis moving."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil  # type: ignore[import-untyped]
from report import Report

from axisync_schemas.memory import Word
from axisync_schemas.ticks import Records
from axisync_service.mapper.counts import CountMap
from support.logread import logs_in, read_log
from support.recording import Recording
from support.synthetic import REST_TICKS, Session

DISTANCE = 1.5
"""Of a move of both arms, rad; the next begins where it ends."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one run.

    Attributes:
        cpu: share of one core.
        bytes_s: growth of the log file.
        lost, gaps: ticks that the ring no longer held; ticks fed that the log does not have.
    """

    cpu: float
    memory_mib: float
    bytes_s: float
    lost: int
    gaps: int


def measure(report: Report, seconds: float) -> None:
    """Measures and prints."""
    costs = {}
    for name, moving in (("standing still", False), ("every axis moving", True)):
        report.say(f"recording for {seconds:g} s, {name}")
        with tempfile.TemporaryDirectory(prefix="axisync-bench-") as directory:
            costs[name] = record(Path(directory), moving, seconds)
    report.table(
        "recorder",
        "The recorder at 500 Hz, 12 axes",
        ["", "of one core", "memory", "MB an hour", "ticks lost", "missing in the log"],
        [
            [
                name,
                f"{100 * cost.cpu:.1f} %",
                f"{cost.memory_mib:.0f} MiB",
                f"{cost.bytes_s * 3600 / 1e6:.0f}",
                str(cost.lost),
                str(cost.gaps),
            ]
            for name, cost in costs.items()
        ],
    )


def record(directory: Path, moving: bool, seconds: float) -> Cost:
    """One run of the recorder's process beside a feeder in real time."""
    with Recording(directory) as recording:
        process = recording.start()
        feed = Feed(recording, moving)
        feed.run(1.0)  # The file's beginning is not counted.
        watched = psutil.Process(process.pid)
        (file,) = logs_in(recording.log_dir)
        size, before = file.stat().st_size, _cpu_s(watched)
        feed.run(seconds)
        cpu = (_cpu_s(watched) - before) / seconds
        memory = watched.memory_full_info().pss / 2**20
        recording.wait_cursor(feed.tick - 500)
        growth = file.stat().st_size - size
        recording.close()
        ticks = read_log(*logs_in(recording.log_dir)).ticks
        return Cost(cpu, memory, growth / seconds, recording.control[Word.RECORDER_LOST], feed.tick - len(ticks))


class Feed:
    """The controller's place: moves of both arms as the cycle would log them, one after another, or none."""

    def __init__(self, recording: Recording, moving: bool) -> None:
        self._recording = recording
        self._records = drives_beside(recording, Session(recording.cell, "both", distance=DISTANCE), moving)
        self.tick = 0
        recording.feeder.record = self._record  # type: ignore[method-assign]

    def run(self, seconds: float) -> None:
        """Ticks on the grid, in real time."""
        self.tick = self._recording.feeder.run(self.tick + 1, seconds)

    def _record(self, tick: int) -> Records:
        record: Records = self._records[tick % len(self._records)]
        record["tick"] = tick
        record["cycle_start_ns"] = self._recording.feeder.origin_ns + tick * self._recording.cell.period_ns
        return record


def drives_beside(recording: Recording, session: Session, moving: bool) -> list[Records]:
    """The session's records with measured positions a count off now and then, and lateness as it varies."""
    records = session.records[REST_TICKS:-REST_TICKS] if moving else session.records[:1] * 1000
    counts = CountMap(recording.cell.axes)
    rng = np.random.default_rng(1)
    made = []
    for record in records:
        own = record.copy()
        noise = rng.integers(-1, 2, len(recording.cell.axes))
        own["position_actual"] = counts.to_position(counts.to_counts(own["position"]) + noise)
        own["lateness_ns"] = rng.integers(10_000, 60_000)
        own["statusword"] = 0x1637
        made.append(own)
    return made


def _cpu_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)
