"""NMT slave: states and commands (CiA 301, 7.2.8.3.2)."""

from enum import IntEnum


class NmtState(IntEnum):
    """As in the heartbeat's byte."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """First byte of an NMT frame."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


NMT_COB_ID = 0x000

NEXT_STATE = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    NmtCommand.RESET_NODE: NmtState.BOOT_UP,
    NmtCommand.RESET_COMMUNICATION: NmtState.BOOT_UP,
}


def command_for(data: bytes, node_id: int) -> NmtCommand | None:
    """The command in an NMT frame, if it is one and meant for this node (or for all: node 0)."""
    if len(data) != 2 or data[1] not in (0, node_id) or data[0] not in NmtCommand.__members__.values():
        return None
    return NmtCommand(data[0])
