"""Wireshark's CANopen dissector reads the golden frames of a bring-up and of a move."""

import shutil
import struct
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from support.framecheck import Frame, parse

GOLDEN = Path(__file__).parents[1] / "golden"
LINKTYPE_CAN_SOCKETCAN = 227
"""Of tcpdump.org's list: identifier in network order, length, 3 bytes of nothing, data."""
SNAPLEN = 16
SERVICES = {0x000: "NMT", 0x080: "SYNC", 0x180: "PDO", 0x200: "PDO", 0x280: "PDO", 0x580: "SDO", 0x600: "SDO",
            0x700: "NMT Error Control"}  # fmt: skip
pytestmark = pytest.mark.skipif(not shutil.which("tshark"), reason="there is no tshark (Debian: apt install tshark)")


def write_pcap(path: Path, frames: list[Frame]) -> None:
    """A capture of one CAN interface, in pcap's first format."""
    with path.open("wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, SNAPLEN, LINKTYPE_CAN_SOCKETCAN))
        for frame in frames:
            packet = struct.pack(">IB3x", frame.can_id, len(frame.data)) + frame.data
            seconds, micros = divmod(round(frame.at * 1e6), 1_000_000)
            file.write(struct.pack("<IIII", seconds, micros, len(packet), len(packet)) + packet)


def dissect(capture: Path) -> list[list[str]]:
    """For each frame: protocols, what CANopen takes it for, and complaints."""
    fields = ("frame.protocols", "_ws.col.Info", "_ws.malformed", "_ws.expert.message")
    options = [option for name in fields for option in ("-e", name)]
    done = subprocess.run(
        ["tshark", "-n", "-r", str(capture), "-d", "can.subdissector,canopen", "-T", "fields", *options],
        capture_output=True, text=True, timeout=100, check=True,
    )  # fmt: skip
    return [line.split("\t") for line in done.stdout.splitlines()]


@pytest.mark.parametrize("name", ["bring_up.log", "move.log"])
def test_no_frame_is_malformed(tmp_path: Path, name: str) -> None:
    frames = [frame for frame in parse(GOLDEN / name) if frame.interface == "kingkong"]
    write_pcap(tmp_path / "bus.pcap", frames)
    seen = dissect(tmp_path / "bus.pcap")
    assert len(seen) == len(frames) > 100
    for frame, (protocols, info, malformed, complaint) in zip(frames, seen, strict=True):
        assert protocols.endswith("can:canopen"), (frame, protocols)
        assert (malformed, complaint) == ("", ""), (frame, malformed, complaint)
        assert SERVICES[frame.can_id & 0x780] in info, (frame, info)
    assert len(Counter(info for _, info, *_ in seen)) > 3


def test_it_would_complain(tmp_path: Path) -> None:
    write_pcap(tmp_path / "bus.pcap", [Frame(0.0, "can0", 0x581, bytes.fromhex("431810"))])
    ((_, _, malformed, _),) = dissect(tmp_path / "bus.pcap")
    assert malformed
