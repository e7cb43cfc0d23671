"""`drive`: objects read and written while nothing moves, and in which words it is refused."""

import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.internal import DriveCommand, GroupCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader
from axisync_service.drives.bring_up import Phase
from axisync_service.motion_controller.step import Core
from support.cells import eod_text
from support.ideal_drive import Bench

TEXT = eod_text()
PLANS = bytearray(PLAN_SLOT_BYTES)


@pytest.fixture
def bench() -> Bench:
    cell = parse_cell(TEXT)
    made = Bench(cell, Core(cell, lambda slot, plan_id: PlanReader(PLANS, slot, plan_id)))
    made.run(2)
    return made


def send(bench: Bench, index: int, sub: int = 0, axis: int = 1, **fields: object) -> str | ErrorBody:
    """The bytes that the drive answered, or the refusal."""
    bench.commands = [DriveCommand(ref=3, axis=axis, index=index, sub=sub, **fields)]  # type: ignore[arg-type]
    bench.run(30)
    error = bench.replies.pop(3)
    return error if isinstance(error, ErrorBody) else bench.core.voice.data.pop(3)


def test_read_and_write(bench: Bench) -> None:
    assert send(bench, 0x6085) == bench.drives[1].server.values[0x6085, 0].hex()
    assert send(bench, 0x6073, data="e803") == "e803"
    assert bench.drives[1].server.values[0x6073, 0] == b"\xe8\x03"


def test_a_number_takes_the_size_of_what_is_there(bench: Bench) -> None:
    bench.drives[1].server.values[0x3456, 7] = b"\0\0"
    assert send(bench, 0x3456, 7, value=-2) == "feff"
    error = send(bench, 0x3456, 7, value=70_000)
    assert isinstance(error, ErrorBody)
    assert error.message == "0x3456:7 has 2 bytes, 70000 does not fit"


def test_an_abort_is_said_in_words(bench: Bench) -> None:
    error = send(bench, 0x3456)
    assert isinstance(error, ErrorBody)
    assert error.message == (
        "axis kingkong.2 (bus kingkong, node 2): reading 0x3456:0: abort 0x06020000: object does not exist"
    )


def test_an_enabled_drive_is_read_but_not_written(bench: Bench) -> None:
    bench.commands = [GroupCommand(op="enable", ref=1, group="kingkong")]
    bench.run(60)
    assert isinstance(send(bench, 0x6079), str)
    error = send(bench, 0x6073, data="e803")
    assert isinstance(error, ErrorBody)
    assert error.code is ErrorCode.WRONG_STATE
    assert send(bench, 0x1003, data="00") == "00"


def test_not_while_the_group_is_being_enabled(bench: Bench) -> None:
    bench.commands = [
        GroupCommand(op="enable", ref=1, group="kingkong"),
        DriveCommand(ref=2, axis=0, index=0x6079, sub=0),
        DriveCommand(ref=4, axis=6, index=0x6079, sub=0),
    ]
    bench.run(40)
    error = bench.replies.pop(2)
    assert isinstance(error, ErrorBody)
    assert error.code is ErrorCode.BUSY
    assert bench.replies.pop(4) is None, "the other group's drives may be read"


def test_a_drive_that_is_not_up(bench: Bench) -> None:
    bench.core.drives[1].bring_up.phase = Phase.PRESENCE
    bench.commands = [DriveCommand(ref=3, axis=1, index=0x6079, sub=0)]
    bench.run(1)
    error = bench.replies.pop(3)
    assert isinstance(error, ErrorBody)
    assert error.code is ErrorCode.UNAVAILABLE


def test_a_drive_lost_meanwhile_is_answered(bench: Bench) -> None:
    bench.drives[1].server.silent = True
    bench.commands = [DriveCommand(ref=3, axis=1, index=0x6079, sub=0)]
    bench.run(2)
    bench.core.drives[1].lose()
    bench.run(1)
    error = bench.replies.pop(3)
    assert isinstance(error, ErrorBody)
    assert "SDO protocol timed out" in error.message
