"""The CiA 402 state machine row by row."""

import pytest

from axisync_schemas.enumerations import DriveState
from axisync_service.drives.cia402 import Controlword, state_of, towards_enabled


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, DriveState.NOT_READY_TO_SWITCH_ON),
        (0x0040, DriveState.SWITCH_ON_DISABLED),
        (0x0250, DriveState.SWITCH_ON_DISABLED),
        (0x0021, DriveState.READY_TO_SWITCH_ON),
        (0x0231, DriveState.READY_TO_SWITCH_ON),
        (0x0023, DriveState.SWITCHED_ON),
        (0x0233, DriveState.SWITCHED_ON),
        (0x0027, DriveState.OPERATION_ENABLED),
        (0x1637, DriveState.OPERATION_ENABLED),
        (0x0007, DriveState.QUICK_STOP_ACTIVE),
        (0x0017, DriveState.QUICK_STOP_ACTIVE),
        (0x000F, DriveState.FAULT_REACTION_ACTIVE),
        (0x001F, DriveState.FAULT_REACTION_ACTIVE),
        (0x0008, DriveState.FAULT),
        (0x0218, DriveState.FAULT),
        (0x0061, DriveState.UNKNOWN),
    ],
)
def test_state_coding(statusword: int, state: DriveState) -> None:
    assert state_of(statusword) is state


@pytest.mark.parametrize(
    ("state", "command"),
    [
        (DriveState.SWITCH_ON_DISABLED, Controlword.SHUTDOWN),
        (DriveState.READY_TO_SWITCH_ON, Controlword.SWITCH_ON),
        (DriveState.SWITCHED_ON, Controlword.ENABLE_OPERATION),
        (DriveState.OPERATION_ENABLED, Controlword.ENABLE_OPERATION),
        (DriveState.QUICK_STOP_ACTIVE, Controlword.DISABLE_VOLTAGE),
        (DriveState.FAULT, Controlword.DISABLE_VOLTAGE),
        (DriveState.FAULT_REACTION_ACTIVE, Controlword.DISABLE_VOLTAGE),
        (DriveState.UNKNOWN, Controlword.DISABLE_VOLTAGE),
        (DriveState.NOT_READY_TO_SWITCH_ON, Controlword.DISABLE_VOLTAGE),
    ],
)
def test_way_to_operation_enabled(state: DriveState, command: Controlword) -> None:
    assert towards_enabled(state) is command
