"""What is decided in Zenoh's callback threads: who asks, how much, how often. Pure; `server` feeds it."""

from axisync_schemas.commands import MAX_REQUEST_BYTES
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.keys import ANONYMOUS, user_of
from axisync_service.actioner.rate import RATE_HZ, RateLimiter


def is_wildcard(key: str) -> bool:
    """Whether a key expression may stand for several keys."""
    return "*" in key or "$" in key


class Door:
    """Checks of a command's key, size and rate. Without authentication there is one user: anonymous."""

    def __init__(self) -> None:
        self._rate = RateLimiter()

    def user(self, key: str) -> str:
        """Who sends a command.

        Raises:
            Refusal: INVALID_REQUEST for a wildcard or no valid name, NOT_AUTHORISED for somebody else.
        """
        user = None if is_wildcard(key) else user_of(key)
        if user is None:
            raise Refusal(
                ErrorCode.INVALID_REQUEST, "a command names its cell, user and verb, without wildcards", key=key
            )
        if user != ANONYMOUS:
            message = f"without authentication the only user is {ANONYMOUS!r}"
            raise Refusal(ErrorCode.NOT_AUTHORISED, message, user=user)
        return user

    @staticmethod
    def check_size(size: int) -> None:
        """Refuses bodies over 64 KiB: TOO_LARGE."""
        if size > MAX_REQUEST_BYTES:
            message = f"{size} bytes, {MAX_REQUEST_BYTES} are allowed"
            raise Refusal(ErrorCode.TOO_LARGE, message, bytes=size, allowed=MAX_REQUEST_BYTES)

    def check_rate(self, user: str, now_ns: int) -> None:
        """Refuses a user's flood: RATE_LIMITED. Not asked for `stop`."""
        if not self._rate.allow(user, now_ns):
            message = f"more than {RATE_HZ:g} requests a second of {user}"
            raise Refusal(ErrorCode.RATE_LIMITED, message, allowed_hz=RATE_HZ)
