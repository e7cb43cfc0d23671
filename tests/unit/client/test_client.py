import time
from pathlib import Path

import numpy as np
import pytest

from axisync_client import (
    Circle,
    Client,
    InvalidArgument,
    Refused,
    TimedOut,
    Unavailable,
    UnexpectedReply,
    mm,
    moves,
    pose,
)
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.programs import read_program
from axisync_schemas.replies import State
from support.cell_peer import Peer, free_port


def test_what_is_so(client: Client, peer: Peer) -> None:
    assert client.cell == "eod"
    assert client.info().version == "9.9"
    config = client.config()
    assert [axis.name for axis in config.axes] == [axis.name for axis in peer.cell.axes]
    for axis, theirs in zip(config.axes, peer.cell.axes, strict=True):  # degrees on the wire: off by a rounding
        assert axis.hard_limits == pytest.approx(theirs.hard_limits, rel=1e-15)
        assert axis.limits == theirs.limits
    assert set(client.state().groups) == {"kingkong", "wukong"}


def test_nobody_listens() -> None:
    begin = time.monotonic()
    with pytest.raises(Unavailable, match=r"nobody listens at tcp/127\.0\.0\.1:.*axisyncd demo"):
        Client(f"127.0.0.1:{free_port()}")
    assert time.monotonic() - begin < 5.0


def test_a_router_without_a_cell() -> None:
    peer = Peer(cells=())
    try:
        with pytest.raises(Unavailable, match="no axisync cell answers"):
            Client(peer.endpoint)
    finally:
        peer.close()


def test_several_cells_must_be_chosen_from() -> None:
    peer = Peer(cells=("east", "west"))
    try:
        with pytest.raises(InvalidArgument, match="east, west"):
            Client(peer.endpoint)
        with Client(peer.endpoint, cell="west") as client:
            assert client.info().name == "west"
    finally:
        peer.close()


def test_a_cell_that_is_not_there(peer: Peer) -> None:
    with pytest.raises(Unavailable, match=r"nobody answers .* axisync/lab/info: is axisyncd running"):
        Client(peer.endpoint, cell="lab")


def test_a_daemon_of_another_schema() -> None:
    peer = Peer(schema_versions=(7,))
    try:
        with pytest.raises(UnexpectedReply, match=r"axisync 9\.9\) serves schema 7, .* \(axisync .*\) speaks schema 1"):
            Client(peer.endpoint)
    finally:
        peer.close()


def test_a_daemon_that_comes_back_with_another_schema(client: Client, peer: Peer) -> None:
    peer.schema_versions = (7,)
    peer.refusals["stop"] = Refusal(ErrorCode.UNSUPPORTED_SCHEMA, "schema 1 is not served", served=[7])
    with pytest.raises(UnexpectedReply, match=r"serves schema 7, this client .* speaks schema 1: install the same"):
        client.stop()


def test_a_reply_that_cannot_be_read(client: Client, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    class NewerState(State):
        colour: str = "red"

    report = NewerState(**dict(peer.state()))
    monkeypatch.setattr(peer, "state", lambda: report)
    with pytest.raises(UnexpectedReply, match=r"state cannot be read \(colour: .*probably of different versions"):
        client.state()


def test_a_clock_that_has_become_another_one_is_learned(client: Client, peer: Peer) -> None:
    peer.clock_ahead_s = 1000.0
    peer.checks_time = True
    with client.lease("kingkong") as arm:
        peer.clock_ahead_s = 2000.0
        assert arm.enable().groups == {"kingkong": "standstill"}
        first, second = [body for verb, _, body in peer.requests if verb == "enable"]
        assert first["request_id"] != second["request_id"]
        assert second["not_after_s"] - first["not_after_s"] == pytest.approx(1000.0, abs=10.0)


def test_a_clock_that_stays_wrong_is_said(client: Client, peer: Peer) -> None:
    peer.refusals["enable"] = Refusal(ErrorCode.STALE, "3.000 s too late")
    with client.lease("kingkong") as arm, pytest.raises(Refused, match=r"STALE: 3\.000 s too late"):
        arm.enable()
    assert [verb for verb, _, _ in peer.requests].count("enable") == 2


def test_the_newest_events(client: Client, peer: Peer) -> None:
    assert client.recent_events() == ()
    peer.events = [peer.event(seq, "happened") for seq in (4, 5)]
    assert [event.seq for event in client.recent_events()] == [4, 5]


def test_the_user_is_in_the_key(peer: Peer) -> None:
    with Client(peer.endpoint, user="ann") as client:
        client.stop()
    assert [(verb, user) for verb, user, _ in peer.requests] == [("stop", "ann")]


def test_a_refusal_carries_the_body(client: Client, peer: Peer) -> None:
    peer.refusals["stop"] = Refusal(ErrorCode.RATE_LIMITED, "too many", allowed=5)
    with pytest.raises(Refused, match="RATE_LIMITED: too many") as caught:
        client.stop()
    assert (caught.value.code, caught.value.details) == ("RATE_LIMITED", {"allowed": 5})


def test_what_got_lost_is_asked_again_with_the_same_body(client: Client, peer: Peer) -> None:
    client.timeout_s = 2.0
    peer.deaf["stop"] = 1
    client.stop("kingkong")
    first, second = [body for verb, _, body in peer.requests if verb == "stop"]
    assert first == second


def test_silence_ends_in_an_error(client: Client, peer: Peer) -> None:
    client.timeout_s = 0.6
    peer.deaf["state"] = 99
    begin = time.monotonic()
    with pytest.raises(TimedOut, match=r"no answer from .* for axisync/eod/state within 0\.6 s"):
        client.state()
    assert 0.5 < time.monotonic() - begin < 5.0


def test_a_daemon_that_comes_back_is_found_again(client: Client, peer: Peer) -> None:
    peer.close()
    with pytest.raises(Unavailable, match="nobody answers"):
        client.state()
    peer.open()
    end = time.monotonic() + 10.0
    while True:
        try:
            assert client.state().tick == 1000
            return
        except Unavailable:
            assert time.monotonic() < end


def test_a_plan_moves_nothing(client: Client, peer: Peer) -> None:
    reply = client.plan_joint("kingkong", np.zeros(6), duration_s=20.0, pulse="parabolic")
    assert (reply.move_id, reply.duration_s, len(reply.T)) == (None, 20.0, 6)
    assert not peer.moves
    assert peer.requests[-1][2]["move"]["pulse"] == "parabolic"


def test_plans_of_every_kind(client: Client, peer: Peer) -> None:
    twelve = client.plan_linear("both", {"kingkong": mm(0, 0, 50), "wukong": pose([0.1, 0.0, 0.0])}, relative=True)
    assert twelve.scalars == ("kingkong.length", "kingkong.rotation", "wukong.length", "wukong.rotation")
    assert client.plan_linear("kingkong", mm(300, 0, 120), speed_scale=0.5).scale == 1.8
    assert client.plan_joint("kingkong", pose([0.3, 0.0, 0.1]), frame="body").limiting == "kingkong.5"
    assert client.plan_circular("kingkong", mm(1, 1, 0), mm(2, 0, 0), frame="tool").duration_s == 4.0
    assert client.plan_path("kingkong", Circle(centre=(0.1, 0.0, 0.0)), pulse="parabolic").duration_s == 4.0
    steps = client.plan_sequence("kingkong", [moves.joint(np.zeros(6), duration_s=1), moves.dwell(0.5)]).steps
    assert [step.kind for step in steps] == ["joint", "dwell"]
    sent = [body for verb, _, body in peer.requests if verb == "plan"]
    assert [body["move"]["kind"] for body in sent] == ["linear", "linear", "joint", "circular", "path", "sequence"]
    assert sent[0]["move"]["target"]["kingkong"] == {"position": [0.0, 0.0, 0.05]}
    assert sent[1]["speed_scale"] == 0.5
    assert not peer.moves


def test_a_program_of_a_file_or_in_memory(client: Client, peer: Peer, tmp_path: Path) -> None:
    path = tmp_path / "nod.toml"
    path.write_text(
        'schema = 1\nname = "nod"\ngroup = "kingkong"\nspeed_scale = 0.5\n[[steps]]\nkind = "dwell"\nduration_s = 1'
    )
    for program in (path, str(path), read_program(path)):
        assert client.plan_program(program, speed_scale=0.5).steps[0].kind == "dwell"
        assert (peer.requests[-1][2]["group"], peer.requests[-1][2]["speed_scale"]) == ("kingkong", 0.25)
    with pytest.raises(InvalidArgument, match=r"no\.toml: cannot be read"):
        client.plan_program(tmp_path / "no.toml")


def test_a_refusal_of_a_path_has_a_fix(client: Client, peer: Peer) -> None:
    nearest = {"position": [0.3, 0.0, 0.1], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    peer.refusals["plan"] = Refusal(ErrorCode.UNREACHABLE, "out of reach by 12 mm", nearest_reachable=nearest)
    with pytest.raises(
        Refused, match=r"UNREACHABLE: out of reach by 12 mm: the nearest .* 300\.00,0\.00,100\.00mm"
    ) as caught:
        client.plan_linear("kingkong", mm(900, 0, 0))
    assert caught.value.details["nearest_reachable"] == nearest


def test_a_closed_client_says_so(peer: Peer) -> None:
    client = Client(peer.endpoint)
    client.close()
    client.close()
    with pytest.raises(Unavailable, match="closed"):
        client.state()


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_timeout_must_be_a_time(timeout_s: float) -> None:
    with pytest.raises(InvalidArgument, match="timeout_s"):
        Client("127.0.0.1:1", timeout_s=timeout_s)
