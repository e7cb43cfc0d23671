"""What can go wrong, as exceptions. All are `AxisyncError`: `message` is one sentence, `fix` what to do about it."""

from pydantic import ValidationError

from axisync_client.fixes import fix_of
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.moves import TAGS
from axisync_schemas.replies import MoveReport


class AxisyncError(Exception):
    """Base of everything this package raises on purpose.

    Attributes:
        code: the error code that fits best, also for errors that arise at the client.
        message: one sentence, without a full stop.
        fix: what to do, or None where nothing can be said.
    """

    code = ErrorCode.INTERNAL

    def __init__(self, message: str, fix: str | None = None) -> None:
        super().__init__(message if fix is None else f"{message}: {fix}")
        self.message = message
        self.fix = fix

    def body(self) -> ErrorBody:
        """The error as a reply would carry it."""
        details = {} if self.fix is None else {"fix": self.fix}
        return ErrorBody(code=self.code, message=self.message, details=details)


class InvalidArgument(AxisyncError, ValueError):
    """An argument that no daemon would accept; nothing was sent."""

    code = ErrorCode.INVALID_REQUEST


class Unavailable(AxisyncError):
    """Nobody answers: no daemon, no connection, no such key, or a closed client."""

    code = ErrorCode.UNAVAILABLE


class TimedOut(Unavailable, TimeoutError):
    """Somebody is there and did not answer in time. The command may still have been carried out."""


class UnexpectedReply(AxisyncError):
    """The daemon speaks another schema version, or sent what its schema does not allow."""

    code = ErrorCode.UNSUPPORTED_SCHEMA


class Refused(AxisyncError):
    """The daemon did not carry the command out.

    Attributes:
        details: axis, time, required and allowed values, as far as they apply.
        request_id: of the refused request; the daemon logged it under this id.
    """

    def __init__(self, body: ErrorBody) -> None:
        super().__init__(body.message, fix_of(body.details))
        self.code = body.code
        self.details = body.details
        self.request_id = body.request_id
        self._body = body

    def __str__(self) -> str:
        return f"{self.code}: {super().__str__()}"

    def body(self) -> ErrorBody:
        """The reply itself."""
        return self._body


class LeaseLost(AxisyncError):
    """The lease lapsed or is void, and what moved comes to `held`; or somebody took it, and what moves goes on."""

    code = ErrorCode.LEASE_FENCED


class MoveNotDone(AxisyncError):
    """A move that did not arrive. Raised by `Move.result()`; `report` says where it is in its life."""

    code = ErrorCode.WRONG_STATE

    def __init__(self, report: MoveReport) -> None:
        reason = f": {report.reason}" if report.reason else ""
        super().__init__(f"move {report.move_id} of {report.group} {_ENDED_AS[type(self)]}{reason}")
        self.report = report


class MoveFailed(MoveNotDone):
    """Ended by a fault."""


class MoveStopped(MoveNotDone):
    """Ended by a stop."""


class MoveHeld(MoveNotDone):
    """Rests on its path; only a lease holder resumes it."""


class MoveTimedOut(AxisyncError, TimeoutError):
    """`Move.wait` gave up waiting; the move itself goes on."""

    code = ErrorCode.UNAVAILABLE


_ENDED_AS: dict[type[MoveNotDone], str] = {
    MoveNotDone: "did not arrive",
    MoveFailed: "failed",
    MoveStopped: "was stopped",
    MoveHeld: "is held",
}


def explain(error: ValidationError) -> str:
    """All faults of a validation in one line, each with its path: `move.target[2]: Input should be ...`."""
    return "; ".join(f"{_path(fault['loc'])}{fault['msg'].removeprefix('Value error, ')}" for fault in error.errors())


def _path(location: tuple[int | str, ...]) -> str:
    parts = (part for part in location if part not in TAGS)
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")
    return f"{text}: " if text else ""
