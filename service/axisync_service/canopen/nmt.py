"""NMT commands and heartbeats (CiA 301, 7.2.8)."""

from enum import IntEnum

from axisync_schemas.enumerations import NmtState

NMT_ID = 0x000
HEARTBEAT_BASE = 0x700


class NmtCommand(IntEnum):
    """Command specifiers of CiA 301, table 31 and following."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


def make_command(command: NmtCommand, node_id: int) -> bytes:
    """Data of an NMT command; node 0 addresses every node of the bus."""
    return bytes((command, node_id))


def make_heartbeat(state: NmtState) -> bytes:
    """Data of a heartbeat frame."""
    return bytes((state,))


def parse_heartbeat(data: bytes) -> NmtState:
    """State in a heartbeat or boot-up frame; UNKNOWN for anything else. Bit 7 of the byte is reserved."""
    if len(data) != 1:
        return NmtState.UNKNOWN
    try:
        return NmtState(data[0] & 0x7F)
    except ValueError:
        return NmtState.UNKNOWN
