"""A disk that is full, read-only or slow; files that are cut by size; old ones that go."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from axisync_schemas.enumerations import RecorderState
from axisync_schemas.memory import PLAN_SLOT_BYTES, PLAN_SLOTS, Word
from axisync_schemas.plan_slots import write_plan
from axisync_service.recorder.recorder import SECOND_NS
from support.logread import logs_in, read_log
from support.plans import joint_plan
from support.recorder_here import Bench

Make = Callable[..., Bench]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EIO, errno.EDQUOT])
def test_a_disk_that_refuses_is_alarmed_once_and_its_return_too(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    bench.run(1, 250)

    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", refuse)
        bench.run(251, 1000)
        assert bench.state == RecorderState.FAILING
        (alarm,) = [event for event in bench.said() if event.kind == "recorder_failing"]
        assert alarm.severity == "error"
        assert alarm.details == {"reason": os.strerror(number), "errno": number}
        bench.step(3.0)
    bench.step(1.1)
    bench.step(1.0)
    assert bench.state == RecorderState.WRITING
    assert [event.kind for event in bench.said()][-2:] == ["log_opened", "recorder_recovered"]
    bench.recorder.close()
    log = bench.log()
    assert log.ticks["tick"].tolist() == list(range(1, 1001))
    assert log.kinds().count("recorder_failing") == log.kinds().count("recorder_recovered") == 1
    assert bench.control[Word.RECORDER_LOST] == 0


def test_a_slow_disk_loses_nothing_that_the_ring_holds(
    make_bench: Make, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench = make_bench(slots=2048, period=0.01)
    bench.run(1, 100)
    stalls = []

    def stall(_fd: int) -> None:
        if not stalls:  # Ten seconds in the kernel, while the cycle goes on.
            stalls.append(bench.control[Word.CONTROLLER_TICK])
            bench.feeder.write(201, 1200)
            bench.now += 10 * SECOND_NS

    monkeypatch.setattr(os, "fdatasync", stall)
    bench.run(101, 200)
    assert stalls == [200]
    assert "kind=slow_sync seconds=10.0 behind=1000" in caplog.text
    bench.run(1201, 1250)
    bench.recorder.close()
    assert bench.control[Word.RECORDER_LOST] == 0
    assert bench.log().ticks["tick"].tolist() == list(range(1, 1251))


def test_files_are_cut_by_size_and_the_oldest_deleted(make_bench: Make, tmp_path: Path) -> None:
    bench = make_bench(period=0.01, settings={"rotate_size": 200e3, "keep": 600e3})
    foreign = tmp_path / "keep-me.mcap"
    foreign.write_bytes(bytes(10**6))
    bench.send("/plans", plan_id=7, group="kingkong")
    bench.run(1, 4000, 100)
    bench.recorder.close()
    files = [path for path in logs_in(tmp_path) if path != foreign]
    sizes = [path.stat().st_size for path in files]
    assert 3 <= len(files) <= 6
    assert max(sizes) < 300e3
    assert sum(sizes) < 600e3 + 3 * 300e3  # It looks every ten seconds only.
    assert foreign.exists()
    log = read_log(*files)
    ticks = log.ticks["tick"].tolist()
    assert ticks == list(range(ticks[0], 4001))
    assert ticks[0] > 1
    assert "log_deleted" in log.kinds()
    for path in files:
        one = read_log(path)
        assert one.complete
        assert list(one.plans) == [7]
        assert one.metadata["axisync.realtime"] == {"controller": "not permitted"}
        assert one.metadata["axisync.machine"]["hostname"]


def test_a_recorder_started_in_mid_move_logs_the_plan_again_from_its_slot(make_bench: Make) -> None:
    bench = make_bench(plans=PLAN_SLOTS * PLAN_SLOT_BYTES)
    cell = bench.cell
    axes = list(cell.axis_indices("both"))
    start = [cell.axes[axis].drive.start for axis in axes]
    plan = joint_plan(cell, "both", start, [angle + 0.1 for angle in start], 1)
    write_plan(bench.plans, 3, plan)
    bench.feeder.write(1, 100)  # Both groups play plan 1.
    bench.recorder.close()
    bench.control[Word.RECORDER_CURSOR] = 50
    bench.recorder = bench.another()
    bench.recorder.open()
    bench.recorder.close()
    found = bench.log().plans[1]
    assert (found["group"], found["move_id"]) == ("both", "m-1")
    assert found["coefficients"] == plan.coefficients.tolist()
