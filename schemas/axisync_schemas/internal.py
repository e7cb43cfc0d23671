"""Messages between the service's own processes: JSON over AF_UNIX SOCK_SEQPACKET, one message a packet.

front -> controller: `ControllerCommand`; controller -> front: `ControllerReply` or `ControllerEvent`.
front -> planner: `PlanJob`; planner -> front: `PlanResult`.
any -> recorder: `LogEntry`.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from axisync_schemas.base import Name, Strict
from axisync_schemas.errors import ErrorBody
from axisync_schemas.moves import Move
from axisync_schemas.replies import Event, JogAhead, MoveReply

MAX_PACKET = 128 * 1024


class GroupCommand(Strict):
    """enable, disable, reset, home: answered when the command is done, or refused; hold, resume: when it has begun."""

    op: Literal["enable", "disable", "reset", "home", "hold", "resume"]
    ref: int
    group: Name


class OverrideCommand(Strict):
    """The rate of a group's path clock from now on, 0..1; answered at once."""

    op: Literal["override"] = "override"
    ref: int
    group: Name
    value: float


class BeginCommand(Strict):
    """Play a plan slot; refused when the lease epoch is old or the plan does not start at the setpoint."""

    op: Literal["begin"] = "begin"
    ref: int
    group: Name
    plan_id: int
    slot: int
    epochs: tuple[int, ...]
    """Lease epoch of each member group, in the order of `Cell.members`."""
    stop_counts: tuple[int, ...] = ()
    """STOP_COUNT of each member when the move was asked for: a stop since then wins over the move."""
    jog_until_ns: int | None = None
    """Of a jog: without a `JogCommand` by then it stops."""


class DriveCommand(Strict):
    """Read an object of a drive by SDO, or write it.

    Attributes:
        axis: index in `Cell.axes`.
        data: hexadecimal bytes to write. value: to write, in as many bytes as the object is found to have.
        Neither: read.
    """

    op: Literal["drive"] = "drive"
    ref: int
    axis: int
    index: int = Field(ge=0, le=0xFFFF)
    sub: int = Field(ge=0, le=0xFF)
    data: str | None = None
    value: int | None = None


JOG_RELEASED, JOG_LAPSED = "jog let go", "jog not asked for in time"
"""Why a jog ends that its client ends, or replaces, and one whose client is silent: it may go on when asked."""


class JogCommand(Strict):
    """A jog that is played goes on until `until_ns`, at `share` (0..1) of the velocity that it was planned with.

    A share of 0 ends it. Answered at once.
    """

    op: Literal["jog"] = "jog"
    ref: int
    group: Name
    plan_id: int
    until_ns: int
    share: float


Command = GroupCommand | OverrideCommand | BeginCommand | DriveCommand | JogCommand
ControllerCommand = Annotated[Command, Field(discriminator="op")]
CONTROLLER_COMMAND: TypeAdapter[Command] = TypeAdapter(ControllerCommand)


class ControllerReply(Strict):
    """Answer to the command with this `ref`; `error` None means done. `data`: hexadecimal bytes that were read."""

    type: Literal["reply"] = "reply"
    ref: int
    tick: int
    error: ErrorBody | None = None
    data: str | None = None


class ControllerEvent(Strict):
    """Something the controller did or saw. MOVE_ENDED carries `plan_id`, `status` and `reason` in details."""

    type: Literal["event"] = "event"
    event: Event


ControllerMessage = Annotated[ControllerReply | ControllerEvent, Field(discriminator="type")]
CONTROLLER_MESSAGE: TypeAdapter[ControllerReply | ControllerEvent] = TypeAdapter(ControllerMessage)


class Reserved(Strict):
    """A plan of another group that moves, is held, or is about to begin: its whole path is taken."""

    slot: int
    plan_id: int


class Jog(Strict):
    """A jog, as `JogRequest` has it: planned as a straight way, as far as it may go."""

    kind: Literal["jog"] = "jog"
    space: Literal["joint", "tool", "base", "body"]
    velocity: tuple[float, ...]


class PlanJob(Strict):
    """Plan `move` for `group` from `start` into plan slot `slot` (None: only say what it would be).

    Attributes:
        rest: [all axes of the cell] where everything else stands.
        reserved: plans whose paths must be kept clear of.
    """

    ref: int
    group: Name
    plan_id: int
    slot: int | None
    start: tuple[float, ...]
    rest: tuple[float, ...]
    reserved: tuple[Reserved, ...] = ()
    move: Move | Jog
    speed_scale: float


class PlanResult(Strict):
    """The plan is in its slot, or why not."""

    ref: int
    plan: MoveReply | None = None
    jog: JogAhead | None = None
    error: ErrorBody | None = None


class LogEntry(Strict):
    """One JSON message for the log.

    Attributes:
        log_time_ns: monotonic; the recorder maps it to wall time by one offset for each file.
        slot: the recorder adds the plan's coefficients from this plan slot.
    """

    topic: str
    log_time_ns: int
    data: dict[str, Any]
    slot: int | None = None
    plan_id: int | None = None


@dataclass(slots=True)
class GroupStatus:
    """One group as the controller sees it; `plan_id` 0 and `slot` -1 where it plays none.

    Attributes:
        ready: every drive of the group is brought up, so that `enable` can work.
        override: the rate at which it runs along its paths.
    """

    state: int
    plan_id: int
    slot: int
    reason: str | None
    ready: bool
    override: float = 1.0


@dataclass(slots=True)
class DriveStatus:
    """One drive; `error_code` is that of its last EMCY, 0 where none is active.

    Attributes:
        velocity: rad/s, torque: share of the rated torque; by TPDO2, None where the drive does not send it.
        temperature: degrees Celsius, voltage: V, safe_torque_off: read now and then; None where not known.
        homed: None where the axis needs no homing. serial: its serial number, 0 where not known.
    """

    state: int
    nmt: int
    statusword: int
    error_code: int
    error: str | None
    velocity: float | None = None
    torque: float | None = None
    temperature: float | None = None
    voltage: float | None = None
    safe_torque_off: bool | None = None
    homed: bool | None = None
    serial: int = 0


@dataclass(slots=True)
class BusStatus:
    """One bus; `load` is the share of its bits used over the last second."""

    state: str
    load: float
    sent: int
    received: int
    lost: int


@dataclass(slots=True)
class ControllerStatus:
    """What the controller writes into the `status` mailbox, 20 times a second and at each change of a group's state."""

    tick: int
    now_ns: int
    groups: tuple[GroupStatus, ...]
    drives: tuple[DriveStatus, ...]
    buses: tuple[BusStatus, ...]
    skipped_ticks: int
    homed_changes: int = 0
    """`Word.HOMED_CHANGES` when this was written."""


CONTROLLER_STATUS = TypeAdapter(ControllerStatus)
"""Plain dataclasses: made and written in half the time of models, which matters within a cycle."""


class RecorderStatus(Strict):
    """What the recorder writes into the `recorder` mailbox with each event of its own.

    Attributes:
        file: name of the log file being written; None while there is none.
        events: the newest, oldest first. Front publishes what it has not seen yet.
    """

    file: str | None
    events: tuple[Event, ...]
