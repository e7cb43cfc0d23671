import io
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from rich.console import Console

from axisync_cli import watch_view
from axisync_client import Client, Unavailable
from axisync_client import client as client_module
from support.cell_peer import Peer


def drawn(content: object, width: int = 100) -> str:
    out = Console(file=io.StringIO(), width=width)
    out.print(content)
    return out.file.getvalue()  # type: ignore[attr-defined]


def test_state_and_events_fit_into_a_terminal(peer: Peer) -> None:
    text = drawn(watch_view.frame(peer.state(), [peer.event(1, "x" * 300)] * watch_view.NEWEST, None), width=80)
    assert "kingkong" in text
    assert "move_accepted" in text
    assert len(text.splitlines()) <= 24


def test_silence_is_said(peer: Peer) -> None:
    text = drawn(watch_view.frame(peer.state(), [], "nothing came"))
    assert text.startswith("nothing came: the state below is old")


def test_a_daemon_that_goes_and_comes_back(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_module, "STREAM_SILENCE_S", 0.3)
    monkeypatch.setattr(watch_view, "DRAWN_EVERY_S", 0.0)
    out = io.StringIO()
    terminal = Console(file=out, width=100, height=40, force_terminal=True)
    client = Client(peer.endpoint)
    states, news = client.states(), client.events()
    past = [peer.event(1, "before")]
    watching = threading.Thread(target=watch_view.draw, args=(terminal, states, news, past))
    until(lambda: states.poll() is not None, lambda: peer.publish("state", peer.state(1).model_dump_json()))
    watching.start()
    peer.publish("state", peer.state(2).model_dump_json())
    until(lambda: "nothing came on axisync/eod/state" in out.getvalue())
    seen = len(out.getvalue())
    peer.publish("events", peer.event(2, "back again").model_dump_json())
    until(lambda: "back again" in out.getvalue()[seen:], lambda: peer.publish("state", peer.state(3).model_dump_json()))
    client.close()
    watching.join(10.0)
    assert not watching.is_alive()
    assert "before" in out.getvalue()


def until(what: Callable[[], object], meanwhile: Callable[[], None] = lambda: None) -> None:
    end = time.monotonic() + 20.0
    while not what():
        assert time.monotonic() < end
        meanwhile()
        time.sleep(0.02)


def test_a_daemon_that_never_spoke(client: Client) -> None:
    with client.states() as states, client.events() as news, pytest.raises(Unavailable):
        watch_view.draw(Console(file=io.StringIO()), states, news, [])


@pytest.fixture
def client(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> Iterator[Client]:
    monkeypatch.setattr(client_module, "STREAM_SILENCE_S", 0.3)
    with Client(peer.endpoint) as connected:
        yield connected
