"""Frames byte for byte (CiA 301)."""

import pytest

from axisync_schemas.enumerations import NmtState
from axisync_service.canopen import sync
from axisync_service.canopen.emcy import describe, describe_register, parse_emergency
from axisync_service.canopen.nmt import NmtCommand, make_command, make_heartbeat, parse_heartbeat
from axisync_service.canopen.pdo import make_rpdo1, parse_tpdo1, parse_tpdo2


def test_nmt() -> None:
    assert make_command(NmtCommand.START, 5) == bytes.fromhex("0105")
    assert make_command(NmtCommand.ENTER_PRE_OPERATIONAL, 0) == bytes.fromhex("8000")
    assert make_heartbeat(NmtState.OPERATIONAL) == b"\x05"


@pytest.mark.parametrize(
    ("data", "state"),
    [
        ("00", NmtState.BOOT_UP),
        ("05", NmtState.OPERATIONAL),
        ("7f", NmtState.PRE_OPERATIONAL),
        ("85", NmtState.OPERATIONAL),
        ("04", NmtState.STOPPED),
        ("33", NmtState.UNKNOWN),
        ("", NmtState.UNKNOWN),
        ("0505", NmtState.UNKNOWN),
    ],
)
def test_heartbeat(data: str, state: NmtState) -> None:
    assert parse_heartbeat(bytes.fromhex(data)) is state


def test_pdo() -> None:
    assert make_rpdo1(0x000F, -2) == bytes.fromhex("0f00feffffff")
    assert parse_tpdo1(bytes.fromhex("271600000100")) == (0x1627, 0x10000)
    assert parse_tpdo2(bytes.fromhex("feffffff83ff")) == (-2, -125)


def test_sync_counter_follows_the_tick() -> None:
    assert [sync.counter(tick) for tick in (1, 2, 240, 241, 481)] == [1, 2, 240, 1, 1]
    assert sync.FRAMES[240] == b"\xf0"


def test_emergency() -> None:
    emergency = parse_emergency(bytes.fromhex("1186210102030405"))
    assert emergency is not None
    assert (emergency.code, emergency.register, emergency.words) == (0x8611, 0x21, "following error")
    assert parse_emergency(b"short") is None


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x8130, "heartbeat of the controller lost"),
        (0x2399, "current, device output side"),
        (0x8199, "communication"),
        (0x7126, "motor"),
        (0x7320, "position sensor"),
        (0x8612, "reference limit"),
        (0x00FF, "no error"),
        (0x4999, "temperature"),
        (0xFF77, "manufacturer specific"),
        (0xE000, "unknown error"),
    ],
)
def test_error_codes_in_words(code: int, words: str) -> None:
    assert describe(code) == words


def test_error_register_in_words() -> None:
    assert describe_register(0x00) == "no error"
    assert describe_register(0x11) == "generic, communication"
    assert describe_register(0xA0) == "device profile, manufacturer"
