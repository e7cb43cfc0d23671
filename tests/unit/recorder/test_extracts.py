"""A short file around each fault."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from axisync_service.recorder.extracts import MOST, Fault, Faults
from axisync_service.recorder.names import FAULTS
from axisync_service.recorder.recorder import SECOND_NS
from support.logread import read_log
from support.recorder_here import Bench, no_space

PERIOD = 0.01
SECOND = 100  # ticks

Make = Callable[..., Bench]


def extracts(bench: Bench) -> list[Path]:
    return sorted((bench.directory / FAULTS).glob("*.mcap"))


def test_ten_seconds_before_and_five_after(make_bench: Make) -> None:
    bench = make_bench(period=PERIOD)
    bench.send("/plans", plan_id=1, group="kingkong")
    bench.run(1, 11 * SECOND)
    bench.event("group_state")
    bench.event("drive_lost", "error")
    bench.run(11 * SECOND + 1, 16 * SECOND)
    assert extracts(bench) == []
    bench.run(16 * SECOND + 1, 16 * SECOND + 30, 10)
    (path,) = extracts(bench)
    assert path.name == "eod-20231114T223011Z-fault-drive_lost.mcap"
    log = read_log(path)
    assert log.complete
    assert log.ticks["tick"].tolist() == list(range(SECOND, 16 * SECOND + 1))
    fed = b"".join(bench.feeder.record(tick).tobytes() for tick in log.ticks["tick"].tolist())
    assert log.ticks.tobytes() == fed
    assert list(log.plans) == [1]
    assert {"group_state", "drive_lost"} <= set(log.kinds())
    assert set(log.attachments) == {"cell.toml", "versions.json"}
    assert (np.diff(log.log_times_ns) == 10_000_000).all()
    bench.recorder.close()
    whole = bench.log()
    (told,) = [event.data for event in whole.events if event.data["kind"] == "log_extract"]
    assert told["details"]["file"] == path.name
    start = whole.log_times_ns[whole.ticks["tick"].tolist().index(SECOND)]
    assert start == log.log_times_ns[0]


def test_a_recorder_started_anew_still_knows_what_was_before_from_the_ring(make_bench: Make) -> None:
    bench = make_bench(slots=2048, period=PERIOD)
    bench.run(1, 11 * SECOND)
    bench.event("drive_lost", "error")
    bench.recorder = bench.another()  # The first is gone, as by kill -9.
    bench.recorder.open()
    bench.run(11 * SECOND + 1, 17 * SECOND)
    (path,) = extracts(bench)
    assert read_log(path).ticks["tick"].tolist() == list(range(SECOND, 16 * SECOND + 1))


def test_closing_writes_what_there_is(bench: Bench) -> None:
    bench.run(1, 300)
    bench.event("cycle_failed", "error")
    bench.step(0.0)
    bench.recorder.close()
    (path,) = extracts(bench)
    assert read_log(path).ticks["tick"].tolist() == list(range(1, 301))


def test_what_is_no_fault_has_no_extract(bench: Bench) -> None:
    bench.event("realtime", "warning")
    bench.event("recorder_failing", "error", source="front")
    bench.event("recorder_lost", "error", source="recorder")
    bench.step()
    bench.recorder.close()
    assert extracts(bench) == []


def test_faults_that_come_together_are_one_and_a_storm_is_bounded() -> None:
    faults = Faults()
    for number in range(100):
        faults.add(Fault("drive_fault", number * SECOND_NS // 2))
    due = faults.due(10**12)
    assert [fault.at_ns for fault in due] == [number * SECOND_NS for number in range(MOST)]
    assert faults.left_out == 100 - 2 * MOST
    faults.add(Fault("drive_fault", 200 * SECOND_NS))
    assert [fault.at_ns for fault in faults.due(300 * SECOND_NS)] == [200 * SECOND_NS]


def test_an_extract_that_cannot_be_written_harms_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench.event("bus_failed", "error")
    bench.run(1, 250)
    mkdir = Path.mkdir

    def refuse(path: Path, mode: int = 0o777, parents: bool = False, exist_ok: bool = False) -> None:
        if path.name == FAULTS:
            no_space()
        mkdir(path, mode, parents, exist_ok)

    monkeypatch.setattr(Path, "mkdir", refuse)
    bench.run(251, 3000)
    assert "kind=extract_failed fault=bus_failed" in caplog.text
    assert extracts(bench) == []
    bench.recorder.close()
    assert bench.log().ticks["tick"].tolist() == list(range(1, 3001))
    assert os.listdir(bench.directory) != []
