"""From the daemon to the frames: over a real connection, to a stand-in for the daemon."""

import json
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest
from starlette.websockets import WebSocket

from axisync_dashboard.link import Address, DaemonLink
from axisync_dashboard.live import parse, same_origin
from axisync_dashboard.telemetry import Telemetry
from axisync_schemas import topics
from support.cell_peer import Peer
from support.daemon import wait_for

PATIENCE_S = 30.0


@pytest.fixture
def peer() -> Iterator[Peer]:
    running = Peer()
    yield running
    running.close()


@pytest.fixture
def link(peer: Peer) -> Iterator[DaemonLink]:
    linked = DaemonLink(Address(peer.endpoint), Telemetry())
    linked.start()
    wait_for(lambda: not linked.telemetry.trouble, "connected", PATIENCE_S)
    yield linked
    linked.close()


def test_frames_hold_what_changed_or_everything(link: DaemonLink, peer: Peer) -> None:
    telemetry = link.telemetry
    first = telemetry.frame()
    assert json.loads(first.full)["x"] == json.loads(first.changes)["x"]
    assert telemetry.generation == 1
    second = telemetry.frame()
    news = json.loads(second.changes)
    assert (second.number, news["x"], news["cell"]) == (first.number + 1, {}, 1)
    assert json.loads(second.full)["x"] == json.loads(first.full)["x"]
    assert not {"p", "e"} & news.keys()


def test_events_come_in_the_next_frame_and_stay_in_full_ones(link: DaemonLink, peer: Peer) -> None:
    telemetry = link.telemetry

    def heard() -> bool:
        peer.publish(topics.EVENTS.name, peer.event(1, "something happened").model_dump_json())
        return bool(telemetry.events)

    wait_for(heard, "an event", PATIENCE_S)
    assert "something happened" in telemetry.frame().changes
    assert "something happened" in telemetry.frame().full


def test_silence_is_stale_and_said(link: DaemonLink, peer: Peer) -> None:
    telemetry = link.telemetry
    wait_for(lambda: not telemetry.fresh, "old", PATIENCE_S)
    assert json.loads(telemetry.frame().changes)["ok"] is False
    wait_for(lambda: bool(telemetry.trouble), "said", PATIENCE_S)


def test_a_lost_daemon_is_found_again(link: DaemonLink, peer: Peer) -> None:
    peer.close()
    wait_for(lambda: "axisyncd" in link.telemetry.trouble, "lost", PATIENCE_S)
    peer.open()
    wait_for(lambda: link.telemetry.fresh, "found", PATIENCE_S)
    assert link.telemetry.generation == 1, "the same cell file: pages go on"


@pytest.mark.parametrize(
    ("text", "message"), [('{"ack":3}', {"ack": 3}), ("[1]", {}), ("no", {}), ('{"stop":"' + "x" * 2000 + '"}', {})]
)
def test_what_is_no_message_of_the_page_is_nothing(text: str, message: dict[str, Any]) -> None:
    assert parse(text) == message


@pytest.mark.parametrize(
    ("origin", "welcome"),
    [(None, True), ("http://127.0.0.1:7448", True), ("http://evil.example", False), ("null", False)],
)
def test_other_sites_may_not_listen(origin: str | None, welcome: bool) -> None:
    headers = {"host": "127.0.0.1:7448"} | ({} if origin is None else {"origin": origin})
    assert same_origin(cast(WebSocket, SimpleNamespace(headers=headers))) is welcome
