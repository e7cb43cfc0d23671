"""The recorder's loop in this process, on a clock of the test's own: when it flushes, syncs, begins anew, gives up."""

import os

import pytest

from axisync_schemas.enumerations import RecorderState
from axisync_schemas.memory import Word
from axisync_service.recorder import recorder as module
from axisync_service.recorder.recorder import FLUSH_NS, SECOND_NS
from support.logread import logs_in, read_log
from support.recorder_here import SLOTS, Bench, no_space


def test_the_cursor_moves_with_whole_chunks_only(bench: Bench) -> None:
    seen = set()
    for tick in range(1, 400):
        bench.feeder.write(tick, tick)
        bench.step(0.001)
        if bench.cursor not in seen:
            assert len(bench.log().ticks) == max(0, bench.cursor - 1)
        seen.add(bench.cursor)
    assert 4 <= len(seen) <= 6
    assert bench.cursor <= 400


def test_the_cursor_is_not_where_the_reader_is(bench: Bench) -> None:
    bench.feeder.write(1, 250)  # Two chunks, and the beginning of a third.
    bench.step()
    assert 150 < bench.cursor < 250
    assert len(bench.log().ticks) == bench.cursor - 1


def test_what_waits_is_flushed_within_a_second(bench: Bench) -> None:
    bench.step(1.0)
    bench.feeder.write(1, 3)
    bench.step()
    assert bench.cursor == 1
    bench.step(FLUSH_NS / SECOND_NS)
    assert bench.cursor == 4
    assert len(bench.log().ticks) == 3


def test_the_heartbeat_is_the_newest_step(bench: Bench) -> None:
    bench.step()
    assert bench.control[Word.RECORDER_NS] == bench.now


def test_an_hour_is_a_file_and_each_has_the_plans_it_needs(bench: Bench) -> None:
    bench.send("/plans", plan_id=1, group="kingkong")
    bench.send("/plans", plan_id=2, group="wukong")
    bench.send("/plans", plan_id=3, group="kingkong")
    bench.feeder.write(1, 100)
    bench.step()
    bench.step(bench.cell.recorder.rotate_after)
    bench.feeder.write(101, 150)
    bench.step()
    bench.recorder.close()
    first, second = sorted(logs_in(bench.directory))
    assert read_log(first).complete
    assert sorted(read_log(first).plans) == [1, 2, 3]
    assert sorted(read_log(second).plans) == [2, 3]
    assert bench.log().ticks["tick"].tolist() == list(range(1, 151))
    assert bench.log().duplicates == 0


def test_a_controller_that_counts_anew_begins_a_file(bench: Bench) -> None:
    bench.feeder.write(1, 200)
    bench.step()
    bench.feeder.write(1, 30)
    bench.step()
    bench.recorder.close()
    counts = [len(read_log(path).ticks) for path in sorted(logs_in(bench.directory), key=lambda p: (len(p.name), p))]
    assert counts == [200, 30]


def test_ticks_the_controller_never_wrote_are_said_but_not_counted_as_lost(bench: Bench) -> None:
    bench.feeder.write(1, 10)
    bench.feeder.write(15, 20)
    bench.step()
    bench.recorder.close()
    events = [event.data for event in bench.log().events if event.data["kind"] == "recorder_lost"]
    assert [event["details"]["ranges"] for event in events] == [[[11, 14]]]
    assert events[0]["details"]["lost"] == 0
    assert bench.control[Word.RECORDER_LOST] == 0


def test_a_gap_is_counted_once_though_its_file_fails(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench.feeder.write(1, SLOTS + 10)
    for _ in range(3):
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", no_space)
            bench.step(1.1)
        assert bench.state == RecorderState.FAILING
    bench.feeder.write(SLOTS + 11, SLOTS + 13)
    bench.step(1.1)
    bench.recorder.close()
    assert bench.control[Word.RECORDER_LOST] == 13
    assert bench.log().ticks["tick"].tolist() == list(range(14, SLOTS + 14))


def test_a_failing_sync_ends_the_file_and_the_next_second_brings_a_new_one(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.feeder.write(1, 300)
    bench.step()
    cursor = bench.cursor
    with monkeypatch.context() as patch:
        patch.setattr(os, "fdatasync", no_space)
        bench.send("/events", n=1)
        bench.step(1.1)
    assert (bench.state, bench.recorder.path) == (RecorderState.FAILING, None)
    bench.send("/events", n=2)
    bench.feeder.write(301, 400)
    bench.step(0.5)
    assert bench.recorder.path is None
    assert bench.cursor >= cursor
    bench.step(0.6)
    bench.step(1.0)
    assert bench.state == RecorderState.WRITING
    bench.recorder.close()
    log = bench.log()
    assert log.ticks["tick"].tolist() == list(range(1, 401))
    assert {1, 2} <= {event.data.get("n") for event in log.events}


def test_no_new_file_while_the_disk_has_hardly_any_room(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fdatasync", no_space)
    bench.feeder.write(1, 10)
    bench.step(1.1)
    monkeypatch.undo()
    monkeypatch.setattr(module, "MIN_FREE_BYTES", 1 << 62)
    for _ in range(5):
        bench.step(1.1)
        assert (bench.state, bench.recorder.path) == (RecorderState.FAILING, None)
    monkeypatch.undo()
    bench.step(1.1)
    assert bench.recorder.path is not None


def test_closing_without_a_disk_says_what_is_missing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(os, "write", no_space)
    bench.feeder.write(1, 300)
    assert not bench.recorder.close()
    assert "kind=log_incomplete ticks=300" in caplog.text


def test_all_messages_of_a_round_survive_a_file_that_fails_at_the_first(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "write", no_space)
    for number in range(9):
        bench.send("/events", n=number, padding="x" * 14_000)
    for seconds in (0.1, 1.1, 1.1):
        bench.step(seconds)
        assert bench.state == RecorderState.FAILING
    monkeypatch.undo()
    bench.step(1.1)
    bench.recorder.close()
    numbers = [event.data["n"] for event in bench.log().events if "n" in event.data]
    assert numbers == list(range(9))
