"""The recorder's smaller parts, each alone."""

import contextlib
import json
import logging
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from axisync_schemas.internal import LogEntry
from axisync_schemas.memory import Control, Word
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import TickLayout
from axisync_service.recorder.backlog import Backlog
from axisync_service.recorder.clocks import ClockPair, measure
from axisync_service.recorder.entries import Entries, Message
from axisync_service.recorder.gaps import LOST, NAMED, NEVER_WRITTEN, Gap, GapReport
from axisync_service.recorder.kernel_file import KernelFile
from axisync_service.recorder.rate_limit import RateLimited
from axisync_service.recorder.ring_reader import RingReader

LAYOUT = TickLayout(2, 1)
SLOTS = 16


class Ring:
    """A ring and its words."""

    def __init__(self) -> None:
        self.control = Control(bytearray(Control.size(1)), 1)
        self.ring = TickRing(bytearray(TickRing.size(LAYOUT, SLOTS)), LAYOUT, SLOTS)
        self.reader = RingReader(self.control, self.ring)

    def write(self, *ticks: int) -> None:
        for tick in ticks:
            record = LAYOUT.new()
            record["tick"] = tick
            self.ring.write(tick, record)
            self.control[Word.CONTROLLER_TICK] = tick

    def read(self, limit: int = 1000) -> tuple[list[int], list[Gap]]:
        records, gaps = self.reader.read(limit)
        for tick, data in records:
            assert LAYOUT.decode(data)["tick"][0] == tick
        return [tick for tick, _ in records], gaps


@pytest.fixture
def ring() -> Ring:
    return Ring()


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, Entries]]:
    writer, reader = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with writer, reader:
        yield writer, Entries([reader], bytearray(64))


def test_ticks_are_read_once_in_order_and_in_portions(ring: Ring) -> None:
    assert ring.read() == ([], [])
    ring.write(*range(1, 6))
    assert ring.reader.behind == 5
    assert ring.read(3) == ([1, 2, 3], [])
    assert ring.read(3) == ([4, 5], [])
    assert ring.read() == ([], [])


def test_reading_begins_at_the_cursor_and_goes_back_to_it(ring: Ring) -> None:
    ring.write(*range(1, 11))
    ring.control[Word.RECORDER_CURSOR] = 7
    ring.reader.rewind()
    assert ring.read()[0] == [7, 8, 9, 10]
    ring.reader.rewind()
    assert ring.read()[0] == [7, 8, 9, 10]


def test_an_overrun_is_one_gap_of_lost_ticks(ring: Ring) -> None:
    ring.write(*range(1, 31))
    ticks, gaps = ring.read()
    assert gaps == [Gap(1, 14, lost=True)]
    assert ticks == list(range(15, 31))


def test_ticks_that_never_came_are_a_gap_but_not_lost(ring: Ring) -> None:
    ring.write(1, 2, 3, 7, 8)
    assert ring.read() == ([1, 2, 3, 7, 8], [Gap(4, 6, lost=False)])


def test_a_great_leap_of_the_controller_loses_nothing(ring: Ring) -> None:
    ring.write(1, 2, 3)
    ring.read()
    ring.write(10_000_000_000, 10_000_000_001)
    ticks, gaps = ring.read()
    assert ticks == [10_000_000_000, 10_000_000_001]
    assert not any(gap.lost for gap in gaps)
    assert (gaps[0].first, gaps[-1].last) == (4, 9_999_999_999)


def test_a_controller_that_counts_anew_is_noticed_once(ring: Ring) -> None:
    ring.write(*range(1, 11))
    ring.read()
    assert not ring.reader.restarted()
    ring.control[Word.CONTROLLER_TICK] = 0  # Started, no tick yet.
    assert not ring.reader.restarted()
    ring.write(1, 2)
    assert ring.reader.restarted()
    assert not ring.reader.restarted()
    assert ring.read() == ([1, 2], [])


def test_a_gap_that_goes_on_is_one_and_reports_come_once_a_second() -> None:
    second = 1_000_000_000
    report = GapReport()
    assert report.take(0) is None
    report.add(Gap(5, 6, lost=True))
    report.add(Gap(7, 9, lost=True))
    report.add(Gap(10, 10, lost=False))
    taken = report.take(0)
    assert taken is not None
    assert taken[0] == f"6 ticks are missing from the log: of 5, {LOST}; of 1, {NEVER_WRITTEN}"
    assert taken[1] == {"lost": 5, "never_written": 1, "ranges": [[5, 9], [10, 10]], "more": 0}
    report.add(Gap(20, 21, lost=True))
    assert report.take(second - 1) is None
    assert report.take(second - 1, at_once=True) == (
        f"2 ticks are missing from the log: {LOST}", {"lost": 2, "never_written": 0, "ranges": [[20, 21]], "more": 0}
    )  # fmt: skip
    assert report.take(3 * second) is None


def test_a_report_names_so_many_gaps_and_counts_the_rest() -> None:
    report = GapReport()
    for number in range(NAMED + 5):
        report.add(Gap(10 * number, 10 * number + 1, lost=True))
    taken = report.take(0)
    assert taken is not None
    assert len(taken[1]["ranges"]) == NAMED  # type: ignore[arg-type]
    assert taken[1]["more"] == 10


def test_entries_become_messages(pair: tuple[socket.socket, Entries]) -> None:
    writer, entries = pair
    for number in range(3):
        entry = LogEntry(topic="/events", log_time_ns=number, data={"n": number, "x": 0.1})
        writer.send(entry.model_dump_json().encode())
    received = entries.receive()
    assert [(one.topic, one.log_time_ns) for one in received.messages] == [("/events", n) for n in range(3)]
    assert json.loads(received.messages[2].payload) == {"n": 2, "x": 0.1}
    assert received.problems == []
    assert entries.receive().messages == []


@pytest.mark.parametrize(
    "packet",
    [
        b"no JSON",
        b"[]",
        b"\xff\xfe",
        b'{"topic": "/events"}',
        b'{"topic": "/setpoints", "log_time_ns": 1, "data": {}}',
        b'{"topic": "/events", "log_time_ns": 1, "data": {"x": NaN}}',
        b'{"topic": "/events", "log_time_ns": 1, "data": {}, "more": 1}',
        b'{"topic": "/events", "log_time_ns": "1", "data": {}}',
        b" " * 131072 + b"too long",
    ],
)
def test_a_bad_packet_is_a_problem_and_the_next_one_is_read(pair: tuple[socket.socket, Entries], packet: bytes) -> None:
    writer, entries = pair
    writer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
    writer.send(packet)
    writer.send(LogEntry(topic="/events", log_time_ns=1, data={}).model_dump_json().encode())
    received = entries.receive()
    assert len(received.problems) == 1
    assert len(received.messages) == 1


def test_a_socket_whose_writers_are_gone_is_left_alone(pair: tuple[socket.socket, Entries]) -> None:
    writer, entries = pair
    writer.send(LogEntry(topic="/events", log_time_ns=1, data={}).model_dump_json().encode())
    writer.close()
    assert len(entries.receive().messages) == 1
    assert entries.receive().messages == []


def test_a_flood_is_taken_in_portions(pair: tuple[socket.socket, Entries]) -> None:
    writer, entries = pair
    writer.setblocking(False)
    packet = LogEntry(topic="/events", log_time_ns=1, data={}).model_dump_json().encode()
    sent = taken = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            writer.send(packet)
            sent += 1
    assert sent > 256
    while (received := entries.receive()).messages:
        taken += len(received.messages)
        assert len(received.messages) <= 256
        assert received.more == (len(received.messages) == 256)
    assert taken == sent


def message(size: int) -> Message:
    return Message("/events", 0, bytes(size))


def test_the_backlog_keeps_the_newest_messages() -> None:
    backlog = Backlog(limit=100)
    for _ in range(5):
        backlog.add(message(30))
    assert (len(backlog), backlog.dropped) == (3, 2)
    backlog.add(message(1000))
    assert [len(one.payload) for one in backlog] == [1000]
    backlog.clear()
    backlog.add(message(90))
    assert len(backlog) == 1


def test_one_offset_for_a_whole_file() -> None:
    clocks = measure(lambda: 10**12, lambda: 17 * 10**17)
    assert clocks.wall(10**12 + 5) == 17 * 10**17 + 5
    assert ClockPair(10**12, 5).wall(0) == 0
    real = measure()
    assert 0 <= measure().monotonic_ns - real.monotonic_ns < 10**9


def test_the_pair_read_fastest_counts() -> None:
    readings = iter([0, 100, 1000, 1002, 2000, 2100, 3000, 3100, 4000, 4100])
    walls = iter([1, 2, 3, 4, 5])
    assert measure(lambda: next(readings), lambda: next(walls)) == ClockPair(1001, 2)


def test_a_warning_a_second_and_how_many_were_left_out(caplog: pytest.LogCaptureFixture) -> None:
    limited = RateLimited(logging.getLogger("test"))
    second = 1_000_000_000
    for at in (0, 1, 2, second, second + 1):
        limited.warn(at, "noise", "a=1")
    limited.warn(5, "other", "b=2")
    assert [one.message for one in caplog.records] == [
        "kind=noise a=1",
        "kind=noise a=1 left_out=2",
        "kind=other b=2",
    ]


def test_a_kernel_file_never_overwrites_and_can_be_cut(tmp_path: Path) -> None:
    path = tmp_path / "one"
    file = KernelFile(path)
    assert file.write(b"hello world") == 11
    assert path.read_bytes() == b"hello world"  # Without a flush.
    file.cut(5)
    assert (file.tell(), path.read_bytes()) == (5, b"hello")
    file.sync()
    file.close()
    file.close()
    with pytest.raises(FileExistsError):
        KernelFile(path)
