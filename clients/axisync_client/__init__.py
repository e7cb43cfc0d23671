"""axisync for Python programs.

    from axisync_client import Client, deg

    with Client() as client, client.lease("kingkong") as arm:
        arm.enable()
        arm.move_joint(deg(-90, 60, -45, 0, 0, 0)).result()

Radians and metres throughout; `deg` and `mm` make them of degrees and millimetres. `moves` describes every kind of
move. Whatever goes wrong is an `AxisyncError`. `AsyncClient` is the same for asyncio.
"""

from axisync_client import moves
from axisync_client.async_client import AsyncClient
from axisync_client.async_lease import AsyncJog, AsyncLease, AsyncMove
from axisync_client.async_stream import AsyncStream
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
from axisync_client.jog import Jog
from axisync_client.lease import Lease
from axisync_client.move import Move
from axisync_client.moves import pose
from axisync_client.setpoints import Setpoints
from axisync_client.streams import Stream
from axisync_client.units import deg, mm, to_deg, to_mm
from axisync_schemas.enumerations import GroupState, MoveStatus
from axisync_schemas.errors import ErrorCode
from axisync_schemas.moves import Circle, Lissajous, ToolPose
from axisync_schemas.programs import Program

__all__ = [
    "AsyncClient",
    "AsyncJog",
    "AsyncLease",
    "AsyncMove",
    "AsyncStream",
    "AxisyncError",
    "Circle",
    "Client",
    "ErrorCode",
    "GroupState",
    "InvalidArgument",
    "Jog",
    "Lease",
    "LeaseLost",
    "Lissajous",
    "Move",
    "MoveFailed",
    "MoveHeld",
    "MoveNotDone",
    "MoveStatus",
    "MoveStopped",
    "MoveTimedOut",
    "Program",
    "Refused",
    "Setpoints",
    "Stream",
    "TimedOut",
    "ToolPose",
    "Unavailable",
    "UnexpectedReply",
    "deg",
    "mm",
    "moves",
    "pose",
    "to_deg",
    "to_mm",
]
