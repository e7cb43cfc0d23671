"""What can be asked of the daemon, as data: the request, the model of its reply and how long to wait for it.

Built here, sent by a client: blocking and asynchronous clients differ only in how they wait.
"""

import re
from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar
from uuid import uuid4

from pydantic import ValidationError

from axisync_client.errors import InvalidArgument, UnexpectedReply
from axisync_client.moves import AnyMove, build
from axisync_schemas import keys
from axisync_schemas.base import NAME_PATTERN, Strict
from axisync_schemas.cell import Cell
from axisync_schemas.commands import (
    GroupRequest,
    JogRequest,
    LeaseRequest,
    MoveRequest,
    OverrideRequest,
    Request,
    StopRequest,
)
from axisync_schemas.replies import Events, GroupReply, Info, JogReply, LeaseReply, MoveReply, MoveReport, State

R = TypeVar("R", bound=Strict)

GroupVerb = Literal["enable", "disable", "reset", "hold", "resume"]

DRIVES_TIMEOUT_S = 10.0
"""enable, disable and reset are answered when the drives have done it."""

HOMING_PATIENCE_S = 10.0
"""For each drive beside its own time-out: to set it up, to halt it, and to lead it back."""


@dataclass(frozen=True, slots=True)
class Call(Generic[R]):
    """One query.

    Attributes:
        name: verb of a command, or key below the cell (`state`, `moves/<id>`).
        reply: model of the answer.
        request: the command's body; None for a query.
        timeout_s: how long to wait, or None for the client's own time-out.
        expires: the command must not be carried out after the client has given up.
        fresh_s: nor so long after it was sent.
    """

    name: str
    reply: type[R]
    request: Request | None = None
    timeout_s: float | None = None
    expires: bool = False
    fresh_s: float | None = None

    def key(self, cell: str, user: str) -> str:
        """Where the question goes."""
        return keys.topic(cell, self.name) if self.request is None else keys.command(cell, user, self.name)

    def payload(self, not_after_s: float | None) -> bytes:
        """The body on the wire. Made once: a retry sends the same bytes, and so never a second motion."""
        if self.request is None:
            return b""
        stamp = {"not_after_s": not_after_s} if self.expires else {}
        return self.request.model_copy(update=stamp).model_dump_json(exclude_none=True).encode()

    def anew(self) -> "Call[R]":
        """The same under another id: to be asked once more after a refusal."""
        if self.request is None:
            return self
        return replace(self, request=self.request.model_copy(update={"request_id": uuid4()}))

    def read(self, payload: bytes) -> R:
        """The answer.

        Raises:
            UnexpectedReply: it is not what the schema says.
        """
        return read(self.reply, payload, self.name)


def read(model: type[R], payload: bytes, name: str) -> R:
    """A message of the daemon's.

    Raises:
        UnexpectedReply: it is not what the schema says.
    """
    try:
        return model.model_validate_json(payload)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in fault["loc"])
        raise UnexpectedReply(
            f"the daemon's {name} cannot be read ({where}: {fault['msg']})",
            "client and daemon are probably of different versions: install the same on both sides",
        ) from None


INFO = Call("info", Info)
STATE = Call("state", State)
CONFIG = Call("config", Cell)
EVENTS = Call("events", Events)


def move_report(move_id: str) -> Call[MoveReport]:
    """Where a move is in its life."""
    if not re.match(NAME_PATTERN, move_id):
        raise InvalidArgument(f"{move_id!r} is no move id")
    return Call(f"moves/{move_id}", MoveReport)


def acquire(groups: tuple[str, ...], ttl_s: float, take: bool) -> Call[LeaseReply]:
    """A lease on free groups, or with `take` also on held ones."""
    action: Literal["acquire", "take"] = "take" if take else "acquire"
    return Call("lease", LeaseReply, build(LeaseRequest, action=action, groups=groups, ttl_s=ttl_s))


def renew(groups: tuple[str, ...], ttl_s: float, token: str, timeout_s: float) -> Call[LeaseReply]:
    """Keeps a lease."""
    request = build(LeaseRequest, action="renew", groups=groups, ttl_s=ttl_s, lease=token)
    return Call("lease", LeaseReply, request, timeout_s)


def release(groups: tuple[str, ...], token: str, timeout_s: float) -> Call[LeaseReply]:
    """Gives a lease back."""
    request = build(LeaseRequest, action="release", groups=groups, lease=token)
    return Call("lease", LeaseReply, request, timeout_s)


def group_command(verb: GroupVerb, group: str, token: str) -> Call[GroupReply]:
    """enable, disable, reset, hold or resume."""
    return Call(verb, GroupReply, build(GroupRequest, group=group, lease=token), DRIVES_TIMEOUT_S, expires=True)


def override(group: str, value: float, token: str) -> Call[GroupReply]:
    """The rate at which a group runs along its paths, 0..1."""
    request = build(OverrideRequest, group=group, value=float(value), lease=token)
    return Call("override", GroupReply, request, expires=True)


def jog(
    group: str, space: str, velocity: tuple[float, ...], ttl_s: float, token: str, timeout_s: float | None = None
) -> Call[JogReply]:
    """A sign of life of whoever jogs; one that is as old as its own time is none any more."""
    request = build(JogRequest, group=group, space=space, velocity=velocity, ttl_s=float(ttl_s), lease=token)
    return Call("jog", JogReply, request, timeout_s, expires=True, fresh_s=ttl_s)


def home(cell: Cell, group: str, token: str) -> Call[GroupReply]:
    """Waits as long as all drives may take, one after the other; an unknown group is refused by the daemon."""
    try:
        axes = [cell.axes[i] for i in cell.axis_indices(group)]
    except KeyError:
        axes = []
    waits = (axis.drive.homing.timeout_s + HOMING_PATIENCE_S for axis in axes if axis.drive.homing is not None)
    timeout_s = HOMING_PATIENCE_S + sum(waits)
    return Call("home", GroupReply, build(GroupRequest, group=group, lease=token), timeout_s, expires=True)


def stop(group: str) -> Call[GroupReply]:
    """A controlled stop; needs no lease and is never stale."""
    return Call("stop", GroupReply, build(StopRequest, group=group))


def move(group: str, move: AnyMove, speed_scale: float, token: str) -> Call[MoveReply]:
    """Plans, checks and starts a move; answered when it is accepted."""
    request = build(MoveRequest, group=group, move=move, speed_scale=speed_scale, lease=token)
    return Call("move", MoveReply, request, expires=True)


def plan(group: str, move: AnyMove, speed_scale: float) -> Call[MoveReply]:
    """What `move` would do from the present setpoint."""
    return Call("plan", MoveReply, build(MoveRequest, group=group, move=move, speed_scale=speed_scale))
