"""Error codes and the error body. A refusal carries the value, the bound and, where there is one, the fix."""

from enum import StrEnum
from typing import Any

from pydantic import Field

from axisync_schemas.base import Strict


class ErrorCode(StrEnum):
    """Every code a client can receive."""

    INVALID_REQUEST = "INVALID_REQUEST"
    UNSUPPORTED_SCHEMA = "UNSUPPORTED_SCHEMA"
    TOO_LARGE = "TOO_LARGE"
    RATE_LIMITED = "RATE_LIMITED"
    NOT_AUTHORISED = "NOT_AUTHORISED"
    LEASE_REQUIRED = "LEASE_REQUIRED"
    LEASE_HELD = "LEASE_HELD"
    LEASE_FENCED = "LEASE_FENCED"
    STALE = "STALE"
    BUSY = "BUSY"
    WRONG_STATE = "WRONG_STATE"
    NOT_ENABLED = "NOT_ENABLED"
    FAULTED = "FAULTED"
    NOT_HOMED = "NOT_HOMED"
    NOT_FOUND = "NOT_FOUND"
    UNAVAILABLE = "UNAVAILABLE"
    UNREACHABLE = "UNREACHABLE"
    SINGULAR_PATH = "SINGULAR_PATH"
    JOINT_LIMIT = "JOINT_LIMIT"
    SOFT_LIMIT = "SOFT_LIMIT"
    COLLISION = "COLLISION"
    INFEASIBLE_DURATION = "INFEASIBLE_DURATION"
    INTERNAL = "INTERNAL"


class ErrorBody(Strict):
    """Payload of every `reply_err`."""

    request_id: str | None = None
    code: ErrorCode
    message: str
    details: dict[str, Any] = Field(default_factory=dict)


class Refusal(Exception):
    """A command that is not carried out: raised by decisions, turned into `ErrorBody` at the edge."""

    def __init__(self, code: ErrorCode, message: str, **details: Any) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.details = details

    def body(self, request_id: str | None = None) -> ErrorBody:
        """The reply; `request_id` is None where the request could not be read."""
        return ErrorBody(request_id=request_id, code=self.code, message=self.message, details=self.details)
