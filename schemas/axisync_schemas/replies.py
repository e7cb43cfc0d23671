"""Replies to commands and queries, and what is published. SI units; axes in the order of the group."""

from typing import Any, Literal

from pydantic import Field

from axisync_schemas import SCHEMA_VERSION
from axisync_schemas.base import Strict
from axisync_schemas.enumerations import MoveStatus


class Reply(Strict):
    """Answer to a command that was carried out or accepted."""

    request_id: str
    now_s: float


class LeaseReply(Reply):
    """The token proves the lease; the epoch grows whenever a group changes hands."""

    lease: str
    epoch: int
    expires_in_s: float


class GroupReply(Reply):
    """States of the groups concerned, after the command."""

    groups: dict[str, str]


class DriveReply(Reply):
    """What `drive` read, or what the object holds after it was written.

    Attributes:
        object: index and sub-index. name: of the EDS, None for an object that the EDS does not have.
        value: None for bytes that are no value of a known type. data: its bytes, hexadecimal.
    """

    axis: str
    object: str
    name: str | None
    value: int | float | str | None
    data: str


class StepReport(Strict):
    """One step of a sequence: when it begins, how long it takes, and what sets that."""

    kind: str
    begins_s: float
    duration_s: float
    limiting: str | None
    scale: float = 1.0


class AloneReport(Strict):
    """How much room is left, wherever on the path, if the controller died and every drive stopped by itself.

    Attributes:
        limit_margin: to the nearest hard limit, rad; `axis` is whose.
        min_distance_m: between shapes, as `MoveReply.min_distance_m`.
    """

    limit_margin: float
    axis: str
    min_distance_m: float | None = None


class MoveReply(Reply):
    """An accepted move, or what `plan` would do.

    Attributes:
        scalars: names of the rows of T and U; none for a sequence of several steps, whose `steps` say more.
        T: [n][7] segment times, s; U: [n][7] jerk of each segment.
        minimum_s: [n] the time each scalar would need alone, before any stretching.
        limiting: the scalar that sets the duration, or None where nothing moves; a joint where `scale` is above 1.
        scale: how much the path-space limits were stretched for the joints' (1: not at all).
        min_distance_m: the least distance between shapes over the whole path; None where nothing is watched.
        nearest: names of the two.
        end: [n] where it ends, rad.
    """

    move_id: str | None
    group: str
    duration_s: float
    scalars: tuple[str, ...]
    T: tuple[tuple[float, ...], ...]
    U: tuple[tuple[float, ...], ...]
    minimum_s: tuple[float, ...]
    limiting: str | None
    scale: float = 1.0
    min_distance_m: float | None = None
    nearest: tuple[str, str] | None = None
    alone: AloneReport | None = None
    steps: tuple[StepReport, ...] = ()
    end: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()


class JogAhead(Strict):
    """What a jog is planned as: a straight way that ends at rest.

    Attributes:
        velocity: what is in force, in the order of the request; below what was asked for where `limited_by` says why.
        ends_at: what the way ends at; None where that is only how far one plan goes.
    """

    velocity: tuple[float, ...]
    limited_by: str | None = None
    ends_at: str | None = None


class JogReply(Reply):
    """Where a jog is.

    Attributes:
        state: starting: being planned, or waiting until the motion before it rests. moving: as asked, until the time of
            this request is over. standing: ended by a velocity of zero.
        move_id, ahead: of the motion under way.
    """

    group: str
    state: Literal["starting", "moving", "standing"]
    move_id: str | None = None
    ahead: JogAhead | None = None


class MoveReport(Strict):
    """`moves/<move_id>`: where a move is in its life."""

    move_id: str
    group: str
    status: MoveStatus
    progress: float
    reason: str | None = None
    duration_s: float
    now_s: float


class DriveReport(Strict):
    """One drive in `state`.

    Attributes:
        velocity: rad/s, torque: share of the rated torque, as the drive measures them (TPDO2); None where not known.
        temperature: degrees Celsius, voltage: of the DC link, V; safe_torque_off; None where not known.
        homed: None where the axis needs no homing.
    """

    axis: str
    bus: str
    node_id: int
    state: str
    nmt: str
    statusword: int
    error_code: int
    error: str | None
    velocity: float | None = None
    torque: float | None = None
    temperature: float | None = None
    voltage: float | None = None
    safe_torque_off: bool | None = None
    homed: bool | None = None


class GroupReport(Strict):
    """One group in `state`; position and velocity are measured, setpoint is the demand in force."""

    state: str
    move_id: str | None
    progress: float | None
    path_rate: float
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    setpoint: tuple[float, ...]
    pose: dict[str, tuple[float, ...]] | None
    drives: tuple[DriveReport, ...]
    reason: str | None = None
    override: float = 1.0


class Percentiles(Strict):
    """Of one second."""

    p50: float
    p99: float
    max: float


class CycleReport(Strict):
    """How the loop keeps time, over the last second; also in `state`.

    Attributes:
        skipped_ticks, late_ticks: of the last second; late_by: the late ones by cause (scheduler, own_code, bus).
    """

    seq: int = 0
    period_s: float
    lateness_us: Percentiles
    read_us: Percentiles
    decide_us: Percentiles
    write_us: Percentiles
    skipped_ticks: int
    realtime: bool
    record_us: Percentiles | None = None
    late_ticks: int = 0
    late_by: dict[str, int] = Field(default_factory=dict)


class BusReport(Strict):
    """One bus in `state`."""

    state: str
    load: float
    sent: int
    received: int
    lost: int


class RecorderReport(Strict):
    """The log, as far as it is known to have reached the kernel."""

    state: str
    cursor_tick: int
    lost_ticks: int


class State(Strict):
    """`axisync/<cell>/state`, 20 Hz and on query."""

    seq: int = 0
    tick: int
    now_s: float
    groups: dict[str, GroupReport]
    lease: dict[str, str | None]
    cycle: CycleReport | None
    buses: dict[str, BusReport]
    recorder: RecorderReport
    controller: Literal["up", "down"]


class Info(Strict):
    """`axisync/<cell>/info`: versions and clock."""

    name: str
    version: str
    schema_versions: tuple[int, ...] = (SCHEMA_VERSION,)
    now_s: float
    wall_time: str
    pid: int
    log_directory: str
    verbs: tuple[str, ...]


class Event(Strict):
    """One thing that happened: published on `events` and logged.

    Attributes:
        seq: number on the topic; 0 in the log.
        source: front, planner, controller, recorder or supervisor.
        kind: what happened, a word of `axisync_schemas.events`.
        tick: tick of effect, where the controller knows one.
    """

    seq: int = 0
    source: str
    kind: str
    now_s: float
    wall_time: str
    message: str
    tick: int | None = None
    group: str | None = None
    severity: Literal["info", "warning", "error"] = "info"
    details: dict[str, Any] = Field(default_factory=dict)


class Events(Strict):
    """Answer to a query of `events`: the newest ones, the oldest first."""

    now_s: float
    events: tuple[Event, ...]
