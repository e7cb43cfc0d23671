"""Packets of the simcan sockets."""

import pytest

from axisync_emulator.simcan.protocol import FRAME, Hello, ProtocolError, unpack_frames


def test_layout():
    assert FRAME.pack(5, 0x181, 2, b"\x01\x02").hex() == "050000000000000081010000020000000102000000000000"


def test_several_frames_in_a_packet():
    packet = FRAME.pack(1, 0x80, 1, b"\x07") + FRAME.pack(2, 0x201, 0, b"")
    assert unpack_frames(packet) == [(0x80, b"\x07", 1), (0x201, b"", 2)]


@pytest.mark.parametrize("packet", [b"x", FRAME.pack(1, 2, 3, b"abc") + b"x", FRAME.pack(1, 2, 9, bytes(8))])
def test_what_is_no_packet(packet: bytes):
    with pytest.raises(ProtocolError):
        unpack_frames(packet)


def test_hello_there_and_back():
    hello = Hello("kingkong", 1e6, "/run/time.sock")
    assert Hello.unpack(hello.pack()) == hello


@pytest.mark.parametrize("packet", [b"", b"{}", b"[1]", b"\xff", b'{"bus": "a", "bitrate": 1, "x": 2}'])
def test_what_is_no_hello(packet: bytes):
    with pytest.raises(ProtocolError):
        Hello.unpack(packet)


def test_another_version_is_refused():
    with pytest.raises(ProtocolError, match="version 9"):
        Hello.unpack(Hello("a", 1e6, None, version=9).pack())
