import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from axisync_client import Client, Stream, Unavailable, UnexpectedReply, streams
from axisync_client import client as client_module
from axisync_schemas.replies import Event
from support.cell_peer import Peer


def publish_until_seen(peer: Peer, stream: Stream[Any], publish: Callable[[], None]) -> Any:
    """The first message; the subscription may take a moment to reach the router."""
    seen: list[Any] = []
    reader = threading.Thread(target=lambda: seen.append(next(stream)), daemon=True)
    reader.start()
    end = time.monotonic() + 5.0
    while reader.is_alive():
        assert time.monotonic() < end
        publish()
        reader.join(0.02)
    return seen[0]


def read_to(stream: Stream[Event], seq: int) -> list[int]:
    """Numbers of what comes, up to `seq`."""
    seen: list[int] = []
    for event in stream:
        seen.append(event.seq)
        if event.seq >= seq:
            break
    return seen


def test_events_come_in_order_and_gaps_are_counted(client: Client, peer: Peer) -> None:
    with client.events() as events:
        publish_until_seen(peer, events, lambda: peer.publish("events", peer.event(1, "first").model_dump_json()))
        for seq in (2, 3, 6, 7):
            peer.publish("events", peer.event(seq, "more").model_dump_json())
        seen = [seq for seq in read_to(events, 7) if seq > 1]
    assert seen == [2, 3, 6, 7]
    assert events.missed == 2


def test_states(client: Client, peer: Peer) -> None:
    with client.states() as states:
        state = publish_until_seen(peer, states, lambda: peer.publish("state", peer.state(7).model_dump_json()))
    assert state.seq == 7


def test_setpoints_are_arrays(client: Client, peer: Peer) -> None:
    with client.setpoints() as setpoints:
        payload = peer.batch(3, range(100, 110))
        batch = publish_until_seen(peer, setpoints, lambda: peer.publish("setpoints", payload))
    assert isinstance(batch, client_module.Setpoints)
    assert batch.tick.tolist() == list(range(100, 110))
    assert batch.position.shape == (10, 12)
    assert batch.position[2].tolist() == (np.arange(12) + 102.0).tolist()
    assert batch.time_s[0] == pytest.approx(0.2)
    assert not batch.skipped.any()
    assert (batch.seq, len(batch), batch.groups) == (3, 10, ("kingkong", "wukong"))
    assert batch.axes[6] == "wukong.1"
    assert batch.position[0, batch.columns("wukong", peer.cell)].tolist() == [106.0 + i for i in range(6)]


def test_a_batch_of_another_cell_is_an_error(client: Client, peer: Peer) -> None:
    setpoints = client.setpoints()
    peer_thread = threading.Timer(0.2, lambda: peer.publish("setpoints", b"nonsense"))
    peer_thread.start()
    with pytest.raises(UnexpectedReply, match="another cell file"):
        next(setpoints)


def test_silence_of_a_periodic_stream_is_an_error(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_module, "STREAM_SILENCE_S", 0.2)
    with client.states() as states, pytest.raises(Unavailable, match="nothing came on axisync/eod/state"):
        next(states)


def test_silence_of_events_is_one_only_without_a_daemon(
    client: Client, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_module, "STREAM_SILENCE_S", 0.1)
    with client.events() as events:
        event = peer.event(1, "late").model_dump_json()
        threading.Timer(0.5, lambda: peer.publish("events", event)).start()
        assert next(events).message == "late"
        peer.close()
        with pytest.raises(Unavailable, match="nobody answers"):
            next(events)
    peer.open()


def test_a_closed_stream_ends_for_who_waits(client: Client) -> None:
    events = client.events()
    threading.Timer(0.1, events.close).start()
    assert list(events) == []
    events.close()


def test_closing_the_client_ends_streams(peer: Peer) -> None:
    client = Client(peer.endpoint)
    events = client.events()
    threading.Timer(0.1, client.close).start()
    assert list(events) == []


def test_a_slow_reader_loses_the_oldest_and_knows(client: Client, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streams, "CAPACITY", 5)
    with client.events() as events:
        publish_until_seen(peer, events, lambda: peer.publish("events", peer.event(1, "first").model_dump_json()))
        for seq in range(2, 101):
            peer.publish("events", peer.event(seq, "more").model_dump_json())
        end = time.monotonic() + 5.0
        while len(events._waiting) < 5 or b'"seq":100' not in events._waiting[-1]:
            assert time.monotonic() < end
            time.sleep(0.01)
        assert read_to(events, 100) == [96, 97, 98, 99, 100]
    assert events.missed == 94
