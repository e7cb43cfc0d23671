"""Links, the log sink, held messages, timers: on real sockets and memory."""

import os
import selectors
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from axisync_schemas.internal import MAX_PACKET, LogEntry
from axisync_service.links.effects import kill_worker
from axisync_service.links.held import PATIENCE_NS, Held
from axisync_service.links.log_sink import LogSink
from axisync_service.links.seqpacket import RETRY_NS, Link
from axisync_service.links.timers import Timers


class Ends:
    """A link and what it brought."""

    def __init__(self, path: Path) -> None:
        self.selector = selectors.DefaultSelector()
        self.packets: list[bytes] = []
        self.downs = 0
        self.link = Link("test", path, self.selector, self.packets.append, self._down)

    def _down(self) -> None:
        self.downs += 1

    def turn(self) -> None:
        for key, _ in self.selector.select(1.0):
            key.data()


@pytest.fixture
def listening(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as one:
        one.bind(str(tmp_path / "link.sock"))
        one.listen(2)
        yield one


@pytest.fixture
def ends(tmp_path: Path) -> Iterator[Ends]:
    made = Ends(tmp_path / "link.sock")
    yield made
    made.link.close()


def test_it_connects_speaks_and_hears(listening: socket.socket, ends: Ends) -> None:
    assert not ends.link.send(b"early")
    ends.link.on_time(5)
    assert (ends.link.connected, ends.link.since_ns) == (True, 5)
    peer, _ = listening.accept()
    with peer:
        assert ends.link.send(b"there")
        assert peer.recv(100) == b"there"
        peer.send(b"one")
        peer.send(b"two")
        ends.turn()
    assert ends.packets == [b"one", b"two"]


def test_a_dead_peer_is_noticed_once_and_the_link_comes_back(listening: socket.socket, ends: Ends) -> None:
    ends.link.on_time(0)
    peer, _ = listening.accept()
    peer.send(b"last words")
    peer.close()
    ends.turn()
    assert (ends.packets, ends.downs, ends.link.connected) == ([b"last words"], 1, False)
    assert not ends.link.send(b"x")
    ends.link.on_time(RETRY_NS)
    assert ends.link.connected
    listening.accept()[0].close()
    ends.turn()
    assert ends.downs == 2


def test_nobody_there_is_tried_again_later(tmp_path: Path) -> None:
    ends = Ends(tmp_path / "none.sock")
    ends.link.on_time(0)
    assert not ends.link.connected
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as late:
        late.bind(str(tmp_path / "none.sock"))
        late.listen(1)
        ends.link.on_time(RETRY_NS - 1)
        assert not ends.link.connected
        ends.link.on_time(RETRY_NS)
        assert ends.link.connected
        ends.link.close()


def test_a_peer_that_does_not_read_makes_nobody_wait(listening: socket.socket, ends: Ends) -> None:
    ends.link.on_time(0)
    before, sent = time.perf_counter(), 0
    while ends.link.send(bytes(10_000)) and sent < 10_000:
        sent += 1
    assert 0 < sent < 10_000
    assert time.perf_counter() - before < 5.0
    assert ends.link.connected


def test_log_entries_that_do_not_fit_are_counted_and_said_when_they_fit_again() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    theirs.settimeout(5.0)
    sink = LogSink(os.dup(ours.fileno()))
    sent = 0
    while sink.send("/requests", {"text": "x" * 5000}):
        sent += 1
    assert sink.take_lost() == 0, "while the log does not work there is nobody to tell"
    for _ in range(sent):
        theirs.recv(MAX_PACKET)
    assert sink.send("/plans", {"plan_id": 9}, slot=4, plan_id=9)
    assert sink.take_lost() >= 1
    assert sink.take_lost() == 0
    entries = []
    theirs.setblocking(False)
    try:
        while True:
            entries.append(LogEntry.model_validate_json(theirs.recv(MAX_PACKET)))
    except BlockingIOError:
        pass
    assert (entries[-1].topic, entries[-1].slot, entries[-1].plan_id) == ("/plans", 4, 9)
    for end in (sink, ours, theirs):
        end.close()


def test_an_entry_that_is_too_long_is_lost_alone() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    sink = LogSink(os.dup(ours.fileno()))
    assert not sink.send("/requests", {"text": "x" * MAX_PACKET})
    assert sink.send("/requests", {})
    assert sink.take_lost() == 1
    for end in (sink, ours, theirs):
        end.close()


def test_messages_are_held_until_the_record_shows_them() -> None:
    held: Held[str] = Held()
    held.put("first", 10, 0)
    held.put("second", 11, 0)
    held.put("old tick, but in order", 3, 0)
    assert held.due(10, 1) == []
    assert held.due(11, 1) == ["first"]
    assert held.due(12, 1) == ["second", "old tick, but in order"]
    assert not held


def test_messages_are_not_held_for_ever() -> None:
    held: Held[str] = Held()
    held.put("late", 10, 0)
    held.put("later", 10, 5)
    assert held.due(10, PATIENCE_NS) == ["late"]
    assert held.all() == ["later"]
    assert held.all() == []


def test_timers_stay_on_their_grid_and_never_burst() -> None:
    timers, done = Timers(), []
    timers.every(0.01, lambda: done.append("a"), 0)
    assert timers.wait_s(0) == pytest.approx(0.01)
    timers.run(9_999_999)
    assert done == []
    timers.run(10_000_000)
    assert timers.wait_s(10_000_000) == pytest.approx(0.01)
    timers.run(95_000_000)
    assert done == ["a", "a"]
    assert timers.wait_s(95_000_000) == pytest.approx(0.005)
    assert timers.wait_s(200_000_000) == 0.0


def test_only_a_planner_worker_of_this_service_is_killed() -> None:
    sleeper = "import time; time.sleep(60)"
    other = subprocess.Popen([sys.executable, "-c", sleeper])
    worker = subprocess.Popen([sys.executable, "-c", sleeper, "planner_worker"])
    try:
        assert not kill_worker(other.pid, os.getpid())
        assert not kill_worker(worker.pid, os.getppid())
        assert not kill_worker(os.getppid(), os.getpid())
        assert worker.poll() is None
        assert kill_worker(worker.pid, os.getpid())
        assert worker.wait(5.0) == -9
        assert not kill_worker(worker.pid, os.getpid())
    finally:
        for process in (other, worker):
            process.kill()
            process.wait()
