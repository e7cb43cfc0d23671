import json
import math

import pytest

from axisync_client import Circle, InvalidArgument, UnexpectedReply, calls, moves


def test_keys_of_commands_and_queries() -> None:
    assert calls.stop("all").key("eod", "ann") == "axisync/eod/cmd/ann/stop"
    assert calls.STATE.key("eod", "ann") == "axisync/eod/state"
    assert calls.move_report("m-1").key("eod", "ann") == "axisync/eod/moves/m-1"


def test_a_move_on_the_wire() -> None:
    call = calls.move("kingkong", moves.joint([0.5, -1], relative=True, duration_s=8), 0.5, "token")
    body = json.loads(call.payload(12.5))
    assert body.pop("request_id")
    assert body == {
        "schema": 1,
        "not_after_s": 12.5,
        "lease": "token",
        "group": "kingkong",
        "move": {
            "kind": "joint",
            "target": [0.5, -1.0],
            "relative": True,
            "frame": "base",
            "minimise": "acceleration",
            "duration_s": 8.0,
            "pulse": "constant",
            "contacts": [],
        },
        "speed_scale": 0.5,
    }


@pytest.mark.parametrize(
    "call", [calls.stop("all"), calls.acquire(("a",), 2.0, False), calls.release(("a",), "t", 1.0)]
)
def test_stop_and_lease_never_expire(call: calls.Call[calls.R]) -> None:
    assert "not_after_s" not in json.loads(call.payload(12.5))


def test_a_call_has_one_request_id() -> None:
    call = calls.group_command("enable", "kingkong", "token")
    assert call.payload(1.0) == call.payload(1.0)
    again = calls.group_command("enable", "kingkong", "token")
    assert call.payload(1.0) != again.payload(1.0)


def test_take_and_acquire() -> None:
    actions = [json.loads(calls.acquire(("a",), 2.0, take).payload(None))["action"] for take in (False, True)]
    assert actions == ["acquire", "take"]


@pytest.mark.parametrize("scale", [0.0, 1.01, math.nan, "fast"])
def test_a_speed_scale_no_daemon_would_take(scale: float) -> None:
    with pytest.raises(InvalidArgument, match="speed_scale"):
        calls.plan("kingkong", moves.joint([0.0]), scale)


def test_any_move_is_sent_as_it_is() -> None:
    for move in (
        moves.linear([0, 0, 1]),
        moves.circular([0, 0, 1], [0, 1, 1]),
        moves.path(Circle(centre=(0.1, 0.0, 0.0))),
        moves.sequence([moves.dwell(1), moves.joint([0.0])]),
    ):
        body = json.loads(calls.plan("kingkong", move, 1.0).payload(None))
        assert body["move"] == json.loads(move.model_dump_json(exclude_none=True))
        assert "lease" not in body


def test_names_that_are_none() -> None:
    with pytest.raises(InvalidArgument, match="group"):
        calls.stop("king/kong")
    with pytest.raises(InvalidArgument, match="groups"):
        calls.acquire((), 2.0, False)
    with pytest.raises(InvalidArgument, match="ttl_s"):
        calls.acquire(("kingkong",), 0.01, False)
    for move_id in ("", "*", "m-1/..", "m?"):
        with pytest.raises(InvalidArgument, match="is no move id"):
            calls.move_report(move_id)


def test_a_reply_of_another_schema_names_the_field() -> None:
    with pytest.raises(UnexpectedReply, match=r"state cannot be read \(tick"):
        calls.STATE.read(b'{"tick": "seven"}')
