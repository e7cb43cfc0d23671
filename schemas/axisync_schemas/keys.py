"""Key expressions. Identity is in the key: `cmd/<user>/<verb>`, since a query carries no authenticated sender."""

import re

from axisync_schemas.base import NAME_PATTERN

ROOT = "axisync"
ANONYMOUS = "anonymous"
VERBS = (
    "move", "plan", "jog", "hold", "resume", "stop", "override", "enable", "disable", "reset", "home", "lease", "drive",
)  # fmt: skip
"""Every verb of the contract."""

_USER = re.compile(NAME_PATTERN)


def command(cell: str, user: str, verb: str) -> str:
    """Key of a command. `user` may be `*` where a queryable is declared."""
    return f"{ROOT}/{cell}/cmd/{user}/{verb}"


def topic(cell: str, name: str) -> str:
    """Key of a published topic or of a query about the cell: `state`, `config`, `moves/<id>`..."""
    return f"{ROOT}/{cell}/{name}"


def user_of(key: str) -> str | None:
    """The user a command key names, or None where the key is a wildcard or no valid name."""
    parts = key.split("/")
    if len(parts) != 5 or not _USER.match(parts[3]):
        return None
    return parts[3]
