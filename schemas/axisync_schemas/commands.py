"""Requests that clients send to `cmd/<user>/<verb>`. SI units: rad, m, s."""

from typing import Annotated, Literal
from uuid import UUID, uuid4

from pydantic import Field

from axisync_schemas.base import Name, Strict
from axisync_schemas.moves import MAX_AXES, Move

MAX_REQUEST_BYTES = 64 * 1024


class Request(Strict):
    """What every command carries.

    Attributes:
        request_id: same user, id and body give the same answer and never a second motion.
        not_after_s: instant on the daemon's monotonic clock (`now_s` in its replies) after which the command is STALE.
    """

    schema_version: int = Field(alias="schema", default=1)
    request_id: UUID = Field(default_factory=uuid4)
    not_after_s: float | None = None


class LeasedRequest(Request):
    """A command that only a lease holder may send."""

    lease: str | None = Field(default=None, max_length=128)


class LeaseRequest(Request):
    """acquire: free groups; take: also held ones; renew, release: with the token."""

    action: Literal["acquire", "renew", "release", "take"]
    groups: tuple[Name, ...] = Field(min_length=1, max_length=64)
    ttl_s: float = Field(default=2.0, ge=0.2, le=60.0)
    lease: str | None = Field(default=None, max_length=128)


class GroupRequest(LeasedRequest):
    """enable, disable, reset, home, hold, resume: of a group, a compound or "all"."""

    group: Name


class OverrideRequest(LeasedRequest):
    """The rate at which a group runs along its paths, 0..1; it holds until it is changed, for later moves too."""

    group: Name
    value: float = Field(ge=0.0, le=1.0)


class StopRequest(Request):
    """From anyone connected, without a lease; never stale, never rate-limited."""

    group: Name = "all"


class DriveRequest(LeasedRequest):
    """Maintenance: reads an object of a drive, or writes it where `value` is given, which needs a lease.

    Attributes:
        object: `0x6079`, `0x6064:0`, or a name from the EDS.
    """

    axis: Name
    object: str = Field(min_length=1, max_length=128)
    value: int | float | Annotated[str, Field(max_length=256)] | None = None


class JogRequest(LeasedRequest):
    """Moves a group as long as this is repeated, ten times a second or more; one with another velocity replaces it.

    Attributes:
        space: joint: one velocity for each axis, rad/s. tool, base, body: along and about the axes of the tool's frame
            as the motion begins, the arm's base, or O: x, y, z in m/s, then, where it turns, about x, y, z in rad/s.
        velocity: as `space` has it; all zeros ends the jog, and is answered when the group stands.
        ttl_s: from when it is received; without another by then the group stops.
    """

    group: Name
    space: Literal["joint", "tool", "base", "body"] = "joint"
    velocity: tuple[float, ...] = Field(min_length=1, max_length=MAX_AXES)
    ttl_s: float = Field(default=0.2, ge=0.05, le=1.0)


class MoveRequest(LeasedRequest):
    """move and plan."""

    group: Name
    move: Move
    speed_scale: float = Field(default=1.0, gt=0.0, le=1.0)
