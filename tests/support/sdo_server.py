"""A drive's objects behind expedited SDO, written out by hand after CiA 301, 7.2.4.3: for tests that need no bus."""

import struct
from collections.abc import Callable

from axisync_schemas import eds
from axisync_schemas.cell import Axis
from axisync_schemas.enumerations import NmtState
from axisync_service.canopen.nmt import NmtCommand
from axisync_service.drives.bring_up import BringUp
from axisync_service.drives.link import DriveLink

Key = tuple[int, int]
TICK_NS = 2_000_000


class SdoServer:
    """Answers requests from a store that begins with the EDS's defaults.

    Attributes:
        values: bytes by (index, sub); what is not there is aborted with "object does not exist".
        abort: called with index, sub and whether it is a write; an abort code, or None to serve it.
        written, read: every key, in order.
        silent: answers nothing.
    """

    def __init__(self, axis: Axis, serial: int = 77) -> None:
        dictionary, node = eds.drive_dictionary(), axis.drive.node_id
        self.values: dict[Key, bytes] = {}
        for key, entry in dictionary.entries.items():
            default = entry.default_of(node)
            if entry.size:
                self.values[key] = entry.pack(default if default is not None else 0)
        identity = axis.drive.identity
        for sub, value in ((1, identity.vendor_id), (2, identity.product_code), (4, serial)):
            self.values[0x1018, sub] = struct.pack("<I", value)
        self.abort: Callable[[int, int, bool], int | None] = lambda *_: None
        self.written: list[Key] = []
        self.read: list[Key] = []
        self.silent = False

    def answer(self, frame: bytes) -> bytes | None:
        """The response to a request."""
        if self.silent or frame[0] == 0x80:
            return None
        command, index, sub = struct.unpack_from("<BHB", frame)
        writes = command >> 5 == 1
        (self.written if writes else self.read).append((index, sub))
        code = self.abort(index, sub, writes)
        if code is None and (index, sub) not in self.values:
            code = 0x06020000
        if code is not None:
            return struct.pack("<BHBI", 0x80, index, sub, code)
        if writes:
            self.values[index, sub] = frame[4 : 8 - (command >> 2 & 3)]
            return struct.pack("<BHB4x", 0x60, index, sub)
        data = self.values[index, sub]
        return struct.pack("<BHB", 0x43 | (4 - len(data)) << 2, index, sub) + data.ljust(4, b"\0")

    def serve(self, bring_up: BringUp, now_ns: int) -> None:
        """Takes one frame from a drive's SDO client, and answers it; obeys NMT commands."""
        command, bring_up.command = bring_up.command, None
        if command is NmtCommand.START:
            bring_up.nmt = NmtState.OPERATIONAL
        elif command is NmtCommand.ENTER_PRE_OPERATIONAL:
            bring_up.nmt = NmtState.PRE_OPERATIONAL
        frame = bring_up.sdo.poll(now_ns)
        response = self.answer(frame) if frame is not None else None
        if response is not None:
            bring_up.sdo.receive(response)


def run(bring_up: BringUp, server: SdoServer, ticks: int = 400, from_ns: int = 0) -> int:
    """Ticks until it is ready or has failed; the time then, ns."""
    now = from_ns
    for _ in range(ticks):
        now += TICK_NS
        bring_up.step(now)
        server.serve(bring_up, now)
        if bring_up.ready or bring_up.failure is not None:
            break
    return now


def link_run(drive: DriveLink, server: SdoServer, ticks: int, now_ns: int) -> int:
    """As `run`, for a drive's channel after its bring-up."""
    for _ in range(ticks):
        now_ns += TICK_NS
        if drive.channel.busy:
            drive.channel.step(drive.bring_up.sdo)
        server.serve(drive.bring_up, now_ns)
    return now_ns
