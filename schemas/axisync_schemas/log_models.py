"""JSON messages of the log's `/requests`, `/plans` and `/log`; `/events` holds `replies.Event`. SI units."""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any, Self

from pydantic import Field

from axisync_schemas.base import Strict
from axisync_schemas.errors import ErrorBody
from axisync_schemas.replies import MoveReply


class RequestLog(Strict):
    """One command as it came, and how it was answered.

    Attributes:
        user, verb: from the key; the body cannot prove who sent it.
        body: the request without its lease token; None where it was no JSON object.
        received_s, answered_s: monotonic clock.
        tick: tick of effect, where the controller named one.
        reply, error: one of them is set.
    """

    request_id: str | None
    user: str
    verb: str
    body: dict[str, Any] | None
    received_s: float
    answered_s: float
    tick: int | None = None
    reply: dict[str, Any] | None = None
    error: ErrorBody | None = None


class PlanLog(Strict):
    """One accepted plan: what was asked, what was answered, and the polynomials that the controller plays.

    The sender leaves out everything from `knots` on; the recorder reads it from the plan slot. JSON carries each float
    exactly, so setpoints can be computed again to the bit.

    Attributes:
        axes: indices in `Cell.axes`, the order of the columns below.
        knots: [m+1] path parameter, s.
        coefficients: [m][order][n] ascending powers of (s - knots[i]); rad.
        start, end: [n] exact positions before and after, rad.
        rate_codes: the path clock's tables [3][levels][points], uint16, little-endian, zlib, base64; rate_shape: levels
            and points.
        rate_limits: [4][n] acceleration and jerk of moves, then of stops.
        missing: why the polynomials are not here, where they are not.
    """

    plan_id: int
    move_id: str | None
    group: str
    request_id: str | None = None
    user: str | None = None
    move: dict[str, Any] = Field(default_factory=dict)
    speed_scale: float = 1.0
    reply: MoveReply | None = None
    axes: tuple[int, ...] = ()
    knots: tuple[float, ...] = ()
    coefficients: tuple[tuple[tuple[float, ...], ...], ...] = ()
    start: tuple[float, ...] = ()
    end: tuple[float, ...] = ()
    rate_codes: str = ""
    rate_shape: tuple[int, int] = (0, 0)
    rate_limits: tuple[tuple[float, ...], ...] = ()
    missing: str | None = None


class LogLevel(IntEnum):
    """foxglove.LogLevel."""

    UNKNOWN = 0
    DEBUG = 1
    INFO = 2
    WARNING = 3
    ERROR = 4
    FATAL = 5


class WallTime(Strict):
    """Wall time as Foxglove writes it in JSON."""

    sec: int = Field(ge=0)
    nsec: int = Field(ge=0, lt=1_000_000_000)

    @classmethod
    def of(cls, wall_ns: int) -> Self:
        """Of nanoseconds since 1970."""
        sec, nsec = divmod(wall_ns, 1_000_000_000)
        return cls(sec=sec, nsec=nsec)


class LogLine(Strict):
    """A warning or an error of a process: foxglove.Log (https://docs.foxglove.dev/docs/sdk/schemas/log).

    Attributes:
        name: the process.
        file, line: where in its code, or "" and 0 for a line made from an event.
    """

    timestamp: WallTime
    level: LogLevel
    message: str
    name: str
    file: str
    line: int = Field(ge=0)


EVENT_LEVELS = {"warning": LogLevel.WARNING, "error": LogLevel.ERROR}
"""Severities of events that are lines as well."""


def line_of_event(event: Mapping[str, Any], wall_ns: int, left_out: int = 0) -> LogLine:
    """The line of an event (its fields in JSON) whose severity is one of `EVENT_LEVELS`.

    Args:
        wall_ns: when it happened.
        left_out: lines before it that were too many.
    """
    group = f" group={event['group']}" if event.get("group") else ""
    more = f" left_out={left_out}" if left_out else ""
    return LogLine(
        timestamp=WallTime.of(wall_ns),
        level=EVENT_LEVELS[event["severity"]],
        message=f"kind={event.get('kind')}{group} message={event.get('message')!r}{more}",
        name=str(event.get("source")),
        file="",
        line=0,
    )
