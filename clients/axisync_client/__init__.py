"""axisync for Python programs.

    from axisync_client import Client, deg

    with Client() as client, client.lease("kingkong") as arm:
        arm.enable()
        arm.move_joint(deg(-90, 60, -45, 0, 0, 0)).result()

Radians and metres throughout; `deg` makes radians of degrees. Whatever goes wrong is an `AxisyncError`.
"""

from axisync_client.client import Client
from axisync_client.errors import (
    AxisyncError,
    InvalidArgument,
    LeaseLost,
    MoveFailed,
    MoveHeld,
    MoveNotDone,
    MoveStopped,
    MoveTimedOut,
    Refused,
    TimedOut,
    Unavailable,
    UnexpectedReply,
)
from axisync_client.lease import Lease
from axisync_client.move import Move
from axisync_client.setpoints import Setpoints
from axisync_client.streams import Stream
from axisync_client.units import deg, to_deg
from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.errors import ErrorCode

__all__ = [
    "AxisyncError",
    "Client",
    "ErrorCode",
    "GroupState",
    "InvalidArgument",
    "Lease",
    "LeaseLost",
    "Move",
    "MoveFailed",
    "MoveHeld",
    "MoveNotDone",
    "MoveStatus",
    "MoveStopped",
    "MoveTimedOut",
    "Refused",
    "Setpoints",
    "Stream",
    "TimedOut",
    "Unavailable",
    "UnexpectedReply",
    "deg",
    "to_deg",
]
