"""`home` and `drive` as commands: what reaches the controller, what is refused before, how answers become values."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.internal import (
    BusStatus,
    ControllerReply,
    ControllerStatus,
    DriveCommand,
    DriveStatus,
    GroupCommand,
)
from axisync_service.actioner.ports import Answer

Read = Callable[[list[Answer]], dict[str, Any]]


def answered(rig: Any, data: str | None = None, error: ErrorBody | None = None) -> DriveCommand:
    """The controller answers the last command, which is returned."""
    command = rig.ports.commands[-1]
    rig.actioner.on_controller(ControllerReply(ref=command.ref, tick=1, data=data, error=error), rig.observe())
    assert isinstance(command, DriveCommand)
    return command


def test_an_object_is_read_by_index_or_by_name(rig: Any, ok: Read) -> None:
    for text in ("0x6079", "0x6079:0", "DC link circuit voltage"):
        answers = rig.send("drive", axis="wukong.2", object=text)
        command = answered(rig, data="80bb0000")
        assert (command.axis, command.index, command.sub, command.data, command.value) == (7, 0x6079, 0, None, None)
        reply = ok(answers)
        assert (reply["object"], reply["name"], reply["value"]) == ("0x6079:0", "DC link circuit voltage", 48000)


def test_signs_and_texts_by_their_type(rig: Any, ok: Read) -> None:
    answers = rig.send("drive", axis="wukong.2", object="0x6077")
    answered(rig, data="83ff")
    assert ok(answers)["value"] == -125
    answers = rig.send("drive", axis="wukong.2", object="0x1008")
    answered(rig, data=b"drive".hex())
    assert ok(answers)["value"] == "drive"
    answers = rig.send("drive", axis="wukong.2", object="0x3456:2")
    answered(rig, data="0102")
    assert ok(answers) | {"value": 513, "name": None, "data": "0102"} == ok(answers)


def test_a_write_is_packed_by_its_type(rig: Any, ok: Read) -> None:
    answers = rig.send("drive", axis="kingkong.1", object="0x6073", value=1000, lease=rig.lease("kingkong"))
    assert answered(rig, data="e803").data == "e803"
    assert ok(answers)["value"] == 1000
    rig.send("drive", axis="kingkong.1", object="0x3456", value=-1, lease=rig.lease_token)
    assert rig.ports.commands[-1].value == -1


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"axis": "nobody", "object": "0x6079"}, "no axis 'nobody' in this cell: the axes are kingkong.1, "),
        (
            {"axis": "kingkong.1", "object": "no such object"},
            "no object is called 'no such object': give its name in the EDS, or its index",
        ),
        ({"axis": "kingkong.1", "object": "0x60790"}, "is no object"),
        ({"axis": "kingkong.1", "object": "0x6073", "value": 70000}, "is no UNSIGNED16"),
        ({"axis": "kingkong.1", "object": "0x6073", "value": "fast"}, "is no UNSIGNED16"),
        ({"axis": "kingkong.1", "object": "0x6064", "value": 1}, "is read-only"),
        ({"axis": "kingkong.1", "object": "0x3456", "value": 0.5}, "only whole numbers"),
    ],
)
def test_what_cannot_be_is_refused(rig: Any, no: Read, fields: dict[str, Any], words: str) -> None:
    found = no(rig.send("drive", lease=rig.lease("kingkong"), **fields))
    assert found["code"] == "INVALID_REQUEST"
    assert words in found["message"]
    assert not rig.ports.commands


@pytest.mark.parametrize("text", ["0x6040", "0x6060", "0x607A", "0x60C2:1", "0x1017", "0x1800:1", "0x1A00:1", "0x6085"])
def test_what_the_service_relies_on_is_not_written(rig: Any, no: Read, text: str) -> None:
    found = no(rig.send("drive", axis="kingkong.1", object=text, value=1, lease=rig.lease("kingkong")))
    assert "written by the service itself" in found["message"]


def test_a_write_needs_the_lease_of_its_group(rig: Any, no: Read) -> None:
    assert no(rig.send("drive", axis="kingkong.1", object="0x6073", value=1))["code"] == "LEASE_REQUIRED"
    rig.lease("wukong")
    found = no(rig.send("drive", axis="kingkong.1", object="0x6073", value=1, lease=rig.lease_token))
    assert found["code"].startswith("LEASE_")


def test_a_refusal_of_the_controller_is_the_answer(rig: Any, no: Read) -> None:
    answers = rig.send("drive", axis="kingkong.1", object="0x6073")
    answered(rig, error=ErrorBody(code=ErrorCode.BUSY, message="kingkong is moving"))
    assert no(answers)["code"] == "BUSY"


def test_home_is_waited_for_as_long_as_the_drives_may_take(rig: Any) -> None:
    rig.send("home", group="kingkong", lease=rig.lease("kingkong"))
    command = rig.ports.commands[-1]
    assert command == GroupCommand(op="home", ref=command.ref, group="kingkong")


def test_a_move_waits_for_home(rig: Any, no: Read) -> None:
    drive = DriveStatus(state=5, nmt=5, statusword=0, error_code=0, error=None)
    missing = replace(drive, homed=False)
    bus = BusStatus(state="up", load=0.0, sent=0, received=0, lost=0)
    status = ControllerStatus(
        tick=1, now_ns=0, groups=(), drives=(drive, missing, *[drive] * 10), buses=(bus, bus), skipped_ticks=0
    )
    rig.world = replace(rig.world, status=status)
    rig.show(state=GroupState.STANDSTILL)
    found = no(rig.move("kingkong", rig.lease("both")))
    assert found["code"] == "NOT_HOMED"
    assert found["details"] == {"group": "kingkong", "axes": ["kingkong.2"]}
    assert rig.move("wukong", rig.lease_token) == []
    assert json.dumps(found)
