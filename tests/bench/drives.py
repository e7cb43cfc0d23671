"""Drives and buses in lock-step, so that nothing depends on this machine: bring-up, ramp without a controller, load."""

import tempfile
from pathlib import Path

from report import Report

from axisync_emulator.simcan.wire import INTERFRAME_BITS, frame_bits
from support.bus_faults import Played, Setup, play_with
from support.cells import eod_text

LOST_AT = 900
"""SYNC after which kingkong gets no other."""
SYNC, TPDO1, EMCY, SYNC_LOST = 0x080, 0x180, 0x080, 0x8700


def measure(report: Report) -> None:
    """Prints the table."""
    report.say("bringing up 12 drives and moving them in lock-step; then kingkong's SYNC is taken away")
    setup = Setup(eod_text(), range(LOST_AT, LOST_AT + 1))
    with tempfile.TemporaryDirectory(prefix="axisync-bench-") as directory:
        played = play_with(Path(directory), setup, [lambda _rng, _n: {"kind": "lose", "id": SYNC}], 0)
    lines = [
        ["bring-up of 12 drives: first SYNC to the last drive's first TPDO1", f"{bring_up_s(played):.3f} s", "1 s"],
        ["last SYNC to the ramp of a drive (EMCY 0x8700)", f"{ramp_cycles(played):.2f} cycles",
         f"{played.cell.missed_ticks_max + 2} cycles"],
        ["bits reported for wukong against its frames", f"{100 * load_error(played):+.2f} %", "2 %"],
    ]  # fmt: skip
    report.table("drives", "Drives and buses, in bus time", ["", "measured", "at most"], lines)


def bring_up_s(played: Played) -> float:
    """From the first SYNC until every drive sends process data."""
    began = next(frame.at for frame in played.frames if frame.can_id == SYNC)
    first: dict[tuple[str, int], float] = {}
    for frame in played.frames:
        if TPDO1 < frame.can_id < TPDO1 + 0x80:
            first.setdefault((frame.interface, frame.can_id), frame.at)
    assert len(first) == len(played.cell.axes)
    return max(first.values()) - began


def ramp_cycles(played: Played) -> float:
    """From the last SYNC that kingkong's drives had until the last of them says that it stops."""
    frames = [frame for frame in played.frames if frame.interface == "kingkong"]
    last = max(frame.at for frame in frames if frame.can_id == SYNC)
    told = [
        frame.at for frame in frames
        if EMCY < frame.can_id < EMCY + 0x80 and int.from_bytes(frame.data[:2], "little") == SYNC_LOST
    ]  # fmt: skip
    assert len(told) == len(played.cell.axis_indices("kingkong"))
    return (max(told) - last) / played.cell.period


def load_error(played: Played) -> float:
    """How far the bits that the service counted on wukong are off those on its wire, with stuff bits and gaps."""
    names = [bus.name for bus in played.cell.buses]
    seen = [frame for frame in played.frames if frame.interface == "wukong"]
    counted = sum(frame_bits(frame.can_id, frame.data) + INTERFRAME_BITS for frame in seen)
    return played.run.bits[names.index("wukong")] / counted - 1.0
