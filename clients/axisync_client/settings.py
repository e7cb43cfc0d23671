"""Where the daemon is and who asks: arguments win over the environment, the environment over the defaults."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from axisync_client.errors import InvalidArgument
from axisync_schemas.base import NAME_PATTERN
from axisync_schemas.keys import ANONYMOUS

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"

_NAME = re.compile(NAME_PATTERN)
_ENDPOINT = re.compile(r"^(?P<protocol>[a-z0-9_-]+)/\S+$")
_HOST_AND_PORT = re.compile(r"^[^/\s]+:\d{1,5}$")


@dataclass(frozen=True, slots=True)
class Settings:
    """Attributes: endpoint, as Zenoh writes it; cell, or None to be discovered; user, part of every command's key."""

    endpoint: str
    cell: str | None
    user: str


def resolve(endpoint: str | None, cell: str | None, user: str | None, environment: Mapping[str, str]) -> Settings:
    """The settings in force: AXISYNC_ENDPOINT, AXISYNC_CELL and AXISYNC_USER stand in for what is None.

    Raises:
        InvalidArgument: not an endpoint, or not a name.
    """
    cell = cell or environment.get("AXISYNC_CELL") or None
    user = user or environment.get("AXISYNC_USER") or ANONYMOUS
    for what, name in (("cell", cell), ("user", user)):
        if name is not None and not _NAME.match(name):
            raise InvalidArgument(f"{what} {name!r} is no name", "1 to 64 of A-Z a-z 0-9 . _ -")
    return Settings(_endpoint(endpoint or environment.get("AXISYNC_ENDPOINT") or DEFAULT_ENDPOINT), cell, user)


def _endpoint(text: str) -> str:
    if _ENDPOINT.match(text):
        return text
    if _HOST_AND_PORT.match(text):
        return f"tcp/{text}"
    raise InvalidArgument(f"endpoint {text!r} is no address", f"write HOST:PORT or {DEFAULT_ENDPOINT}")
