"""Commands as a whole: leases, groups, idempotency, what is logged."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from uuid import uuid4

import pytest

from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.internal import ControllerReply, GroupCommand
from axisync_service.actioner.ports import Answer

Read = Callable[[list[Answer]], dict[str, Any]]


def test_a_new_front_voids_all_leases_and_keeps_the_epochs(rig: Any) -> None:
    assert rig.ports.leases == {0: (7, 0), 1: (4, 0)}


def test_lease_words_follow_the_lease(rig: Any, ok: Read) -> None:
    reply = ok(rig.send("lease", action="acquire", groups=["wukong"], ttl_s=3.0))
    now_ns = rig.world.now_ns
    assert reply["epoch"] == 8
    assert reply["expires_in_s"] == 3.0
    assert rig.ports.leases[1] == (8, now_ns + 3 * 10**9)
    rig.wait(1.0)
    ok(rig.send("lease", action="renew", groups=["wukong"], lease=reply["lease"], ttl_s=5.0))
    assert rig.ports.leases[1] == (8, now_ns + 6 * 10**9)
    ok(rig.send("lease", action="release", groups=["wukong"], lease=reply["lease"]))
    assert rig.ports.leases[1] == (8, 0)
    assert rig.actioner.holders(rig.world.now_ns) == {"kingkong": None, "wukong": None}
    assert rig.ports.kinds() == ["lease_acquired", "lease_released"]


def test_a_lease_lapses(rig: Any) -> None:
    rig.lease("both", ttl_s=2.0)
    rig.wait(1.9)
    assert rig.actioner.holders(rig.world.now_ns) == {"kingkong": "anonymous", "wukong": "anonymous"}
    rig.wait(0.2)
    assert rig.ports.kinds() == ["lease_acquired", "lease_lapsed"]
    assert {until for _, until in rig.ports.leases.values()} == {0}


def test_a_lapse_is_told_even_if_the_next_holder_is_quicker(rig: Any) -> None:
    rig.lease("both", ttl_s=2.0)
    rig.world = replace(rig.world, now_ns=rig.world.now_ns + 2 * 10**9)
    rig.send("lease", action="take", groups=["both"])
    assert rig.ports.kinds() == ["lease_acquired", "lease_lapsed", "lease_taken"]
    assert [epoch for epoch, until in rig.ports.leases.values() if until] == [9, 9]


def test_two_clients_race_for_one_lease(rig: Any, no: Read) -> None:
    rig.lease("both")
    found = no(rig.send("lease", action="acquire", groups=["kingkong"]))
    assert found["code"] == "LEASE_HELD"
    assert found["details"]["holder"] == "anonymous"


def test_a_lease_of_an_unknown_group_names_its_place(rig: Any, no: Read) -> None:
    found = no(rig.send("lease", action="acquire", groups=["kingkong", "king"]))
    assert found["details"]["errors"][0]["path"] == "groups[1]"


@pytest.mark.parametrize("verb", ["enable", "disable", "reset"])
def test_group_commands_are_answered_when_they_are_done(rig: Any, ok: Read, verb: str) -> None:
    answers = rig.send(verb, group="both", lease=rig.lease("both"))
    command = rig.ports.commands[0]
    assert command == GroupCommand.model_validate({"op": verb, "ref": command.ref, "group": "both"})
    assert answers == []
    rig.show(state=GroupState.DISABLED)
    rig.actioner.on_controller(ControllerReply(ref=command.ref, tick=1), rig.observe())
    assert ok(answers)["groups"] == {"kingkong": "disabled", "wukong": "disabled"}


@pytest.mark.parametrize("verb", ["enable", "disable", "reset", "move"])
def test_commands_need_a_lease(rig: Any, no: Read, verb: str) -> None:
    fields = {"move": {"kind": "joint", "target": [0.0] * 6}} if verb == "move" else {}
    found = no(rig.send(verb, group="kingkong", **fields))
    assert found["code"] == "LEASE_REQUIRED"
    assert found["details"]["holders"] == {"kingkong": None}


def test_a_stopping_service_still_disables(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    rig.world = replace(rig.world, phase=Phase.STOPPING)
    assert no(rig.send("enable", group="all", lease=lease))["code"] == "UNAVAILABLE"
    assert no(rig.move("both", lease))["code"] == "UNAVAILABLE"
    assert rig.send("disable", group="all", lease=lease) == []


def test_without_a_controller(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    rig.world = replace(rig.world, up=False)
    for answers in (rig.move("kingkong", lease), rig.send("enable", group="all", lease=lease)):
        assert no(answers)["code"] == "UNAVAILABLE"


def test_no_move_begins_while_the_log_cannot_be_written(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    rig.world = replace(rig.world, unlogged=True)
    assert no(rig.move("kingkong", lease))["code"] == "UNAVAILABLE"
    assert rig.ports.jobs == []
    rig.world = replace(rig.world, unlogged=False)
    rig.move("kingkong", lease)
    assert len(rig.ports.jobs) == 1


def test_stale_commands_are_never_carried_out(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    assert no(rig.move("both", lease, not_after_s=rig.world.now_s - 0.001))["code"] == "STALE"
    assert rig.ports.jobs == []


def test_the_same_request_moves_once(rig: Any, ok: Read, no: Read) -> None:
    lease, request_id = rig.lease("kingkong"), str(uuid4())
    first = rig.move("kingkong", lease, request_id=request_id)
    second = rig.move("kingkong", lease, request_id=request_id)
    rig.plan(rig.ports.jobs[0])
    rig.actioner.on_controller(ControllerReply(ref=rig.ports.commands[0].ref, tick=1), rig.observe())
    third = rig.move("kingkong", lease, request_id=request_id)
    assert ok(first) == ok(second) == ok(third)
    assert len(rig.ports.jobs) == len(rig.ports.commands) == 1
    other = no(rig.move("kingkong", lease, request_id=request_id, speed_scale=0.5))
    assert other["code"] == "INVALID_REQUEST"
    assert other["request_id"] == request_id
    assert no(rig.send("enable", group="all", lease=lease, request_id=request_id))["code"] == "INVALID_REQUEST"


def test_every_command_is_logged_without_its_token(rig: Any) -> None:
    lease = rig.lease("kingkong")
    rig.move("wukong", lease)
    rig.send_bytes("move", b"\xff\xfe")
    entries = [data for topic, data, _, _ in rig.ports.logged if topic == "/requests"]
    assert [entry["verb"] for entry in entries] == ["lease", "move", "move"]
    assert entries[0]["reply"]["epoch"] == 8
    assert entries[1]["error"]["code"] == "LEASE_REQUIRED"
    assert entries[2]["body"] is None
    assert lease not in json.dumps(entries)


def test_refusals_are_told_but_not_in_floods(rig: Any) -> None:
    for _ in range(100):
        rig.send_bytes("move", b"{")
    told = [kind for kind in rig.ports.kinds() if kind == "request_refused"]
    assert 0 < len(told) <= 20


def test_a_fault_of_ours_is_an_answer_too(rig: Any, no: Read, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(rig.actioner.leases, "acquire", broken)
    found = no(rig.send("lease", action="acquire", groups=["both"]))
    assert found["code"] == "INTERNAL"
    assert "secret" not in json.dumps(found)
