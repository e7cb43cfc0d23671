"""Front, planner and controller come and go; bad starts and clean ends."""

import contextlib
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from axisync_schemas.enumerations import Phase
from axisync_schemas.memory import GroupWord, Word
from axisync_service.process import EXIT_CONFIGURATION

pytestmark = pytest.mark.unhurried

Service = Any
STEP = [0.05] * 6
WARM_S = 90.0
"""For a planner that starts beside other work."""


class DeafLink(threading.Thread):
    """A TCP relay to front whose client goes on sending but, once `deaf`, reads nothing any more."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.deaf = threading.Event()
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.server = socket.socket()
        self.server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        self.server.connect(("127.0.0.1", port))
        self.port = self.listening.getsockname()[1]
        self.start()

    def run(self) -> None:
        client, _ = self.listening.accept()
        with client, contextlib.suppress(OSError):
            while True:
                sources = [client] if self.deaf.is_set() else [client, self.server]
                for source in select.select(sources, [], [], 0.05)[0]:
                    data = source.recv(65536)
                    if not data:
                        return
                    (self.server if source is client else client).sendall(data)

    def close(self) -> None:
        self.listening.close()
        with contextlib.suppress(OSError):
            self.server.shutdown(socket.SHUT_RDWR)
        self.join(5.0)
        self.server.close()


@pytest.fixture
def own(tmp_path: Path, new_service: Callable[[Path], Service]) -> Iterator[Service]:
    """A service of the test's own, running."""
    service = new_service(tmp_path)
    try:
        service.spawn("front")
        service.spawn("planner_worker")
        yield service
    finally:
        service.close()


def wait(found: Any, timeout_s: float = 20.0) -> Any:
    deadline = time.monotonic() + timeout_s
    while not (answer := found()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)
    return answer


def enabled(service: Service) -> tuple[Any, str]:
    client = service.client()
    service.ready(client)
    lease = client.lease()
    client.command("enable", group="all", lease=lease)
    return client, lease


def test_front_is_killed_in_mid_move_and_adopts_what_it_finds(own: Service) -> None:
    client, lease = enabled(own)
    own.peer.pace = 0.0005
    move_id = client.move("both", lease, [0.1] * 12)["move_id"]
    epochs = [own.control.group(i, GroupWord.LEASE_EPOCH) for i in (0, 1)]
    client.session.close()
    own.kill("front")
    wait(lambda: own.peer.groups[0].state.label == "held")
    own.spawn("front")
    client = own.client()
    own.ready(client)
    report = wait(lambda: (r := client.report(move_id))["status"] == "held" and r)
    assert report["group"] == "both"
    assert 0.0 < report["progress"] < 1.0
    state = client.ask("state")
    assert state["lease"] == {"kingkong": None, "wukong": None}
    assert [own.control.group(i, GroupWord.LEASE_UNTIL_NS) for i in (0, 1)] == [0, 0]
    assert client.refused("enable", group="all", lease=lease)["code"] == "LEASE_FENCED"
    fresh = client.command("lease", action="acquire", groups=["both"], ttl_s=30.0)
    assert fresh["epoch"] > max(epochs)
    assert client.report(move_id)["status"] == "held", "nothing resumes by itself"
    client.command("stop")
    wait(lambda: client.report(move_id)["status"] == "stopped")
    own.peer.pace = 10.0
    again = client.move("both", fresh["lease"], [-0.01] * 12)
    assert int(again["move_id"][2:]) > int(move_id[2:])
    wait(lambda: client.report(again["move_id"])["status"] == "succeeded")
    client.session.close()


def test_a_planner_that_hangs_is_killed_after_five_seconds(own: Service, refusal: type[Exception]) -> None:
    client, lease = enabled(own)
    wait(lambda: _moves(client, lease, refusal), WARM_S)
    planner = own.processes["planner_worker"]
    planner.send_signal(signal.SIGSTOP)
    before = time.monotonic()
    body = client.refused("move", group="kingkong", lease=lease, move={"target": STEP})
    assert body["code"] == "INTERNAL"
    assert 4.0 < time.monotonic() - before < 15.0
    assert planner.wait(5.0) == -signal.SIGKILL
    own.spawn("planner_worker")
    wait(lambda: _moves(client, lease, refusal), WARM_S)
    client.session.close()


def test_a_planner_that_dies_is_found_again(own: Service, refusal: type[Exception]) -> None:
    client, lease = enabled(own)
    own.kill("planner_worker")
    body = client.refused("move", group="kingkong", lease=lease, move={"target": STEP})
    assert body["code"] in ("UNAVAILABLE", "INTERNAL")
    own.spawn("planner_worker")
    wait(lambda: _moves(client, lease, refusal), WARM_S)
    client.session.close()


def _moves(client: Any, lease: str, refusal: type[Exception]) -> bool:
    try:
        return bool(client.move("kingkong", lease, [0.001] * 6))
    except refusal:
        return False


def test_a_controller_that_dies_fails_the_move(own: Service) -> None:
    client, lease = enabled(own)
    own.peer.pace = 0.0005
    move_id = client.move("kingkong", lease, STEP)["move_id"]
    own.peer.running = False
    own.peer.join()
    own.peer.drop()
    report = wait(lambda: (r := client.report(move_id))["status"] == "failed" and r)
    assert report["reason"] == "the controller went down"
    assert client.ask("state")["controller"] == "down"
    own.peer = own.new_peer()
    own.peer.start()
    own.ready(client)
    assert {group["state"] for group in client.ask("state")["groups"].values()} == {"disabled"}
    client.session.close()


def test_a_client_that_does_not_read_holds_up_nobody(own: Service) -> None:
    client, _ = enabled(own)
    link = DeafLink(own.port)
    deaf = own.client(link.port)
    try:
        link.deaf.set()
        for _ in range(450):
            deaf.session.get("axisync/eod/schema/*", lambda reply: None, timeout=30.0)
        worst, until = 0.0, time.monotonic() + 3.0
        while time.monotonic() < until:
            before = time.monotonic()
            client.command("stop")
            client.command("plan", group="kingkong", move={"target": STEP})
            worst = max(worst, time.monotonic() - before)
            time.sleep(0.02)
        assert worst < 4.0, "Zenoh's own patience would be 5 s"
        client.session.close()
        own.control[Word.PHASE] = Phase.CLOSING
        before = time.monotonic()
        assert own.processes["front"].wait(10.0) == 0
        assert time.monotonic() - before < 6.0
    finally:
        link.deaf.clear()
        link.close()
        deaf.session.close()


def test_closing_leaves_cleanly(own: Service) -> None:
    client, _ = enabled(own)
    client.session.close()
    own.control[Word.PHASE] = Phase.STOPPING
    time.sleep(0.2)
    assert own.processes["front"].poll() is None, "it still answers while the groups are stopped"
    assert own.processes["planner_worker"].wait(5.0) == 0
    own.control[Word.PHASE] = Phase.CLOSING
    assert own.processes["front"].wait(5.0) == 0
    assert "Traceback" not in own.errors("front") + own.errors("planner_worker")


def test_a_lone_sigterm_ends_once_the_controller_is_done(own: Service) -> None:
    client, _ = enabled(own)
    client.session.close()
    front = own.processes["front"]
    front.send_signal(signal.SIGINT)
    front.send_signal(signal.SIGTERM)
    time.sleep(0.3)
    assert front.poll() is None
    own.control[Word.CONTROLLER_DONE] = 1
    assert front.wait(5.0) == 0


@pytest.mark.parametrize(
    ("listen", "words"), [("tcp/0.0.0.0:0", "only loopback"), ("wire", "not of the form"), (None, "cannot listen")]
)
def test_bad_addresses_are_one_sentence_and_a_code_of_their_own(
    tmp_path: Path, new_service: Callable[[Path], Service], listen: str | None, words: str
) -> None:
    service = new_service(tmp_path)
    try:
        with service.blocked_port() as taken:
            front = service.spawn("front", listen or f"tcp/127.0.0.1:{taken}")
            assert front.wait(20.0) == EXIT_CONFIGURATION
        said = [line for line in service.errors("front").splitlines() if line]
        assert len(said) == 1
        assert words in said[0]
    finally:
        service.close()
