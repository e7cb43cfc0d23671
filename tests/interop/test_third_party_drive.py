"""python-canopen's node, made from the drive's EDS, as a drive that is none of ours: how far the service brings it up.

It has objects, NMT, heartbeat and SDO, but no PDOs: it becomes operational, and is not enabled.
"""

from pathlib import Path

import canopen

from axisync_emulator.simcan.interface import SimCanBus
from axisync_schemas import eds
from axisync_schemas.cell import parse_cell
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import ControllerReply, GroupCommand
from axisync_service.motion_controller.cycle import Cycle
from support.cells import eod_text, small
from support.daemon import patient
from support.lock_step import Script, Steps, conduct, emulated
from vcan.slower_cell import slower

NODE = 2
PERIOD_MS = 10.0
TICKS_MAX = 2000


class Drive:
    """The node on its bus."""

    def __init__(self, channel: Path, eds_file: Path) -> None:
        eds_file.write_text(eds.drive_eds_text(), encoding="utf-8")
        self.network = canopen.Network(bus=SimCanBus(str(channel)))
        self.network.connect()
        self.node = canopen.LocalNode(NODE, str(eds_file))
        self.network.add_node(self.node)
        for sub, value in ((1, 0x41584953), (2, 1), (4, 1234)):
            self.node.object_dictionary[0x1018][sub].value = value
        self.node.object_dictionary[0x6502].value = 0x80
        self.node.nmt.state = "PRE-OPERATIONAL"

    def close(self) -> None:
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()


def test_it_becomes_operational(tmp_path: Path) -> None:
    text = slower(patient(small(eod_text())), PERIOD_MS)
    (tmp_path / "cell.toml").write_text(small(text, axes=1), encoding="utf-8")
    cell = parse_cell(text).on_simcan(str(tmp_path))
    replies: list[ControllerReply | None] = []
    ready: list[str] = []

    def steps() -> Steps:
        for _ in range(TICKS_MAX):
            if ready:
                break
            yield None
        replies.append((yield GroupCommand(op="enable", ref=0, group="kingkong")))

    def look(cycle: Cycle, _tick: int) -> None:
        if cycle.core.drives[NODE - 1].bring_up.ready:
            ready.append(drive.node.nmt.state)

    with emulated(tmp_path / "cell.toml", tmp_path, lock_step=False):
        drive = Drive(tmp_path / "kingkong.sock", tmp_path / "drive.eds")
        try:
            done = conduct(cell, Script(steps()), [], look)
        finally:
            drive.close()
    assert ready[:1] == ["OPERATIONAL"], done.happenings
    objects = drive.node.sdo
    assert objects[0x6060].raw == 8
    assert objects[0x1017].raw == round(cell.drive_heartbeat * 1e3)
    assert objects[0x1400][1].raw == 0x200 + NODE
    assert objects[0x1A00][2].raw == 0x60640020
    (refused,) = replies
    assert refused is not None
    assert refused.error is not None
    assert refused.error.code is ErrorCode.UNAVAILABLE
