"""Bytes to requests: every fault is typed and named."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisync_schemas.cell import Cell
from axisync_schemas.commands import MoveRequest
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.keys import VERBS
from axisync_schemas.moves import CircularMove, JointMove, LinearMove, PathMove, SequenceMove
from axisync_service.actioner.requests import MAX_ERRORS, MODELS, Unreadable, members_of, parse

GOOD: dict[str, Any] = {"group": "kingkong", "move": {"target": [0.0] * 6}}
DWELL = {"kind": "dwell", "duration_s": 1.0}
POSE = {"position": [0.0, 0.0, 0.1]}
REQUEST_ID = "00000000-0000-4000-8000-000000000001"


def fault(verb: str, body: bytes | dict[str, Any]) -> Unreadable:
    raw = body if isinstance(body, bytes) else json.dumps(body).encode()
    with pytest.raises(Unreadable) as caught:
        parse(verb, raw)
    return caught.value


def test_a_good_move() -> None:
    """A joint move where no kind is named."""
    request = parse("move", json.dumps(GOOD).encode())
    assert isinstance(request, MoveRequest)
    assert request.move == JointMove(target=(0.0,) * 6)


@pytest.mark.parametrize(
    ("move", "model"),
    [
        ({"kind": "joint", "target": POSE, "frame": "body"}, JointMove),
        ({"kind": "linear", "target": POSE | {"euler_zyz": [0.1, 0.2, 0.3]}, "retime": False}, LinearMove),
        ({"kind": "linear", "target": {"kingkong": POSE, "wukong": POSE}, "relative": True}, LinearMove),
        ({"kind": "circular", "via": POSE, "target": POSE | {"quaternion": [0.0, 0.0, 0.0, 1.0009]}}, CircularMove),
        ({"kind": "path", "curve": {"type": "helix", "centre": [0.0, 0.0, 1.0], "pitch": 0.1}}, PathMove),
        ({"kind": "path", "curve": {"type": "lissajous", "amplitude": [1, 1, 1], "frequency": [1, 2, 3]}}, PathMove),
        ({"kind": "sequence", "steps": [DWELL, {"kind": "linear", "target": POSE}] * 128}, SequenceMove),
    ],
)
def test_every_kind_of_move(move: dict[str, Any], model: type) -> None:
    request = parse("move", json.dumps(GOOD | {"move": move}).encode())
    assert isinstance(request, MoveRequest)
    assert isinstance(request.move, model)


def test_every_verb_of_the_contract_is_served() -> None:
    assert sorted(MODELS) == sorted(VERBS)


@pytest.mark.parametrize(
    "raw",
    [b"", b"\xff\xfe", b"{", b"[1, 2]", b"null", b"42", b'"move"', b"[" * 5000, b'{"a":' * 5000, b"NaN", b"{}" * 2,
     b'{"group": "\xc3"}', b"\x00" * 100],
)  # fmt: skip
def test_what_is_no_json_object(raw: bytes) -> None:
    error = fault("move", raw)
    assert error.code is ErrorCode.INVALID_REQUEST
    assert error.details["errors"][0]["path"] == ""


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"move": {"target": [0.0, "1"]}}, "move.target[1]"),
        ({"move": {"target": [0.0, float("nan")]}}, "move.target[1]"),
        ({"move": {"target": [0.0, float("inf")]}}, "move.target[1]"),
        ({"move": {"target": []}}, "move.target"),
        ({"move": {"target": [0.0] * 100}}, "move.target"),
        ({"move": {"target": [[[[0.0]]]]}}, "move.target[0]"),
        ({"move": {"target": [0.0], "speed": 1}}, "move.speed"),
        ({"move": {"target": [0.0], "kind": "spiral"}}, "move.kind"),
        ({"move": 5}, "move"),
        ({"move": {"kind": "sequence", "steps": []}}, "move.steps"),
        ({"move": {"kind": "sequence", "steps": [DWELL] * 257}}, "move.steps"),
        ({"move": {"kind": "sequence", "steps": [DWELL] * 10_000}}, "move.steps"),
        ({"move": {"kind": "sequence", "steps": [DWELL, {"kind": "spiral"}]}}, "move.steps[1]"),
        ({"move": {"kind": "sequence", "steps": [{"kind": "sequence", "steps": [DWELL]}]}}, "move.steps[0]"),
        ({"move": {"kind": "sequence", "steps": [{"kind": "dwell", "duration_s": 0}]}}, "move.steps[0].duration_s"),
        ({"move": {"kind": "linear"}}, "move.target"),
        ({"move": {"kind": "linear", "target": {"position": [0.0, 0.0]}}}, "move.target.position[2]"),
        ({"move": {"kind": "linear", "target": POSE | {"quaternion": [0.0, 0.0, 0.0, 1.002]}}}, "move.target"),
        ({"move": {"kind": "linear", "target": POSE | {"quaternion": [0.0] * 4}}}, "move.target"),
        ({"move": {"kind": "linear", "target": POSE, "linear_limits": [0.1, 0.0, 1.0]}}, "move.linear_limits[1]"),
        ({"move": {"kind": "linear", "target": POSE, "frame": "moon"}}, "move.frame"),
        ({"move": {"kind": "linear", "target": POSE, "retime": 1}}, "move.retime"),
        ({"move": {"kind": "circular", "target": POSE}}, "move.via"),
        ({"move": {"kind": "path", "curve": {"type": "spiral"}}}, "move.curve"),
        (
            {"move": {"kind": "path", "curve": {"type": "circle", "centre": [0, 0, 1], "angle": 1e9}}},
            "move.curve.angle",
        ),
        ({"move": {"target": [0.0], "duration_s": 0}}, "move.duration_s"),
        ({"move": {"target": [0.0], "relative": 1}}, "move.relative"),
        ({"speed_scale": 0}, "speed_scale"),
        ({"speed_scale": "1"}, "speed_scale"),
        ({"speed_scale": True}, "speed_scale"),
        ({"group": "../etc"}, "group"),
        ({"group": 3}, "group"),
        ({"request_id": "seven"}, "request_id"),
        ({"not_after_s": "now"}, "not_after_s"),
        ({"lease": "x" * 1000}, "lease"),
        ({"haste": True}, "haste"),
        ({"schema": True}, "schema"),
        ({"schema": None}, "schema"),
    ],
)
def test_wrong_fields_are_named_with_their_value(change: dict[str, Any], path: str) -> None:
    error = fault("move", GOOD | change)
    assert error.code is ErrorCode.INVALID_REQUEST
    assert path in [found["path"] for found in error.details["errors"]]
    assert all("value" in found and "message" in found for found in error.details["errors"])


def test_the_request_id_is_given_back_where_it_could_be_read() -> None:
    assert fault("move", GOOD | {"request_id": REQUEST_ID, "speed_scale": 2}).request_id == REQUEST_ID
    assert fault("move", GOOD | {"request_id": 5}).request_id is None


@pytest.mark.parametrize("version", [0, 2, 99, "1", 1.5])
def test_other_schema_versions(version: object) -> None:
    error = fault("move", GOOD | {"schema": version, "unheard_of": 1, "request_id": REQUEST_ID})
    assert error.code is ErrorCode.UNSUPPORTED_SCHEMA
    assert error.details["served"] == [1]
    assert error.request_id == REQUEST_ID


@pytest.mark.parametrize("where", ["", "move"])
def test_a_flood_of_members_is_refused_as_one_fault(where: str) -> None:
    flood = {f"k{i}": 0 for i in range(5000)}
    error = fault("move", GOOD | flood if not where else GOOD | {where: flood})
    assert len(error.details["errors"]) == 1
    assert error.details["errors"][0]["path"] == where


def test_many_faults_and_long_values_stay_short() -> None:
    error = fault("move", GOOD | {f"k{i}" * 300: "v" * 9000 for i in range(50)})
    assert len(error.details["errors"]) == MAX_ERRORS
    assert len(json.dumps(error.details)) < 4000


@given(st.binary(max_size=200))
def test_any_bytes(raw: bytes) -> None:
    for verb in MODELS:
        try:
            parse(verb, raw)
        except Unreadable as error:
            json.dumps(error.details)


def test_groups(eod: Cell) -> None:
    assert members_of(eod, "wukong") == (1,)
    assert members_of(eod, "both") == members_of(eod, "all") == (0, 1)
    with pytest.raises(Refusal) as caught:
        members_of(eod, "kong")
    assert caught.value.code is ErrorCode.INVALID_REQUEST
    assert caught.value.details["errors"][0] == {
        "path": "group", "message": "group: no group 'kong' in this cell", "value": "kong"
    }  # fmt: skip
    assert caught.value.details["groups"] == ["kingkong", "wukong", "both", "all"]
