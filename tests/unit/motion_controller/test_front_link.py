"""The controller's socket to front: bounded, never waiting, deaf to nonsense."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from axisync_schemas.internal import GroupCommand
from axisync_service.motion_controller.front_link import COMMANDS_PER_TICK, FrontLink


@pytest.fixture
def link(tmp_path: Path) -> Iterator[tuple[FrontLink, Path]]:
    path = tmp_path / "controller.sock"
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listening.bind(str(path))
    listening.listen(2)
    front_link = FrontLink(listening)
    yield front_link, path
    front_link.close()


def connect(path: Path) -> socket.socket:
    peer = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    peer.connect(str(path))
    return peer


def command(ref: int) -> bytes:
    return GroupCommand(op="enable", ref=ref, group="a").model_dump_json().encode()


def test_nobody_there(link: tuple[FrontLink, Path]) -> None:
    assert link[0].poll() == []
    assert not link[0].connected
    link[0].send(b"to nobody")


def test_commands_are_bounded_per_tick_and_none_is_lost(link: tuple[FrontLink, Path]) -> None:
    with connect(link[1]) as peer:
        for ref in range(COMMANDS_PER_TICK + 3):
            peer.send(command(ref))
        first, second = link[0].poll(), link[0].poll()
    assert [c.ref for c in first] == list(range(COMMANDS_PER_TICK))
    assert [c.ref for c in second] == [8, 9, 10]


def test_end_of_file_means_front_is_gone_and_a_new_one_is_taken(link: tuple[FrontLink, Path]) -> None:
    peer = connect(link[1])
    link[0].poll()
    assert link[0].connected
    peer.close()
    link[0].poll()
    assert not link[0].connected
    with connect(link[1]) as again:
        again.send(command(5))
        assert [c.ref for c in link[0].poll()] == [5]


def test_nonsense_is_passed_over(link: tuple[FrontLink, Path]) -> None:
    with connect(link[1]) as peer:
        peer.send(b"{not json")
        peer.send(b'{"op":"explode","ref":1,"group":"a"}')
        peer.send(command(2))
        assert [c.ref for c in link[0].poll()] == [2]
        assert link[0].malformed == 2
        for _ in range(3 * COMMANDS_PER_TICK):
            peer.send(b"{")
        peer.send(command(3))
        assert [len(link[0].poll()) for _ in range(4)] == [0, 0, 0, 1]


def test_a_front_that_does_not_read_costs_messages_not_time(link: tuple[FrontLink, Path]) -> None:
    with connect(link[1]):
        link[0].poll()
        for _ in range(10_000):
            link[0].send(bytes(200))
    assert link[0].lost > 0
