"""Messages between the service's own processes: JSON over AF_UNIX SOCK_SEQPACKET, one message a packet.

front -> controller: `ControllerCommand`; controller -> front: `ControllerReply` or `ControllerEvent`.
front -> planner: `PlanJob`; planner -> front: `PlanResult`.
any -> recorder: `LogEntry`.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from axisync_schemas.base import Name, Strict
from axisync_schemas.commands import Move
from axisync_schemas.errors import ErrorBody
from axisync_schemas.replies import Event, MoveReply

MAX_PACKET = 128 * 1024


class GroupCommand(Strict):
    """enable, disable, reset: answered when the command is done, or refused."""

    op: Literal["enable", "disable", "reset"]
    ref: int
    group: Name


class BeginCommand(Strict):
    """Play a plan slot; refused when the lease epoch is old or the plan does not start at the setpoint."""

    op: Literal["begin"] = "begin"
    ref: int
    group: Name
    plan_id: int
    slot: int
    epochs: tuple[int, ...]
    """Lease epoch of each member group, in the order of `Cell.members`."""


ControllerCommand = Annotated[GroupCommand | BeginCommand, Field(discriminator="op")]
CONTROLLER_COMMAND: TypeAdapter[GroupCommand | BeginCommand] = TypeAdapter(ControllerCommand)


class ControllerReply(Strict):
    """Answer to the command with this `ref`; `error` None means done."""

    type: Literal["reply"] = "reply"
    ref: int
    tick: int
    error: ErrorBody | None = None


class ControllerEvent(Strict):
    """Something the controller did or saw. MOVE_ENDED carries `plan_id`, `status` and `reason` in details."""

    type: Literal["event"] = "event"
    event: Event


ControllerMessage = Annotated[ControllerReply | ControllerEvent, Field(discriminator="type")]
CONTROLLER_MESSAGE: TypeAdapter[ControllerReply | ControllerEvent] = TypeAdapter(ControllerMessage)


class PlanJob(Strict):
    """Plan `move` for `group` from `start` into plan slot `slot` (None: only say what it would be)."""

    ref: int
    group: Name
    plan_id: int
    slot: int | None
    start: tuple[float, ...]
    move: Move
    speed_scale: float


class PlanResult(Strict):
    """The plan is in its slot, or why not."""

    ref: int
    plan: MoveReply | None = None
    error: ErrorBody | None = None


class LogEntry(Strict):
    """One JSON message for the log. `slot`: the recorder adds the plan's coefficients from this plan slot."""

    topic: str
    log_time_ns: int
    data: dict[str, Any]
    slot: int | None = None
    plan_id: int | None = None
