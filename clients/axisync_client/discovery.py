"""Which cell a client means, and whether it speaks its language."""

import json
from importlib import metadata

from axisync_client.errors import InvalidArgument, Unavailable, UnexpectedReply
from axisync_schemas import SCHEMA_VERSION
from axisync_schemas.keys import ROOT


def own_version() -> str:
    """Of this package, as installed."""
    try:
        return metadata.version("axisync")
    except metadata.PackageNotFoundError:
        return "of unknown version"


def the_cell(keys: list[str], endpoint: str) -> str:
    """The one cell among the keys (`axisync/<cell>/info`) that answered.

    Raises:
        Unavailable: none.
        InvalidArgument: several; names them.
    """
    cells = sorted({parts[1] for key in keys if len(parts := key.split("/")) == 3 and parts[0] == ROOT})
    if not cells:
        raise Unavailable(
            f"a Zenoh router, but no axisync cell answers at {endpoint}", "is axisyncd running, and is it this address?"
        )
    if len(cells) > 1:
        raise InvalidArgument(
            f"several cells answer at {endpoint}: {', '.join(cells)}", "choose one by --cell, cell= or AXISYNC_CELL"
        )
    return cells[0]


def check_versions(info: bytes) -> None:
    """Looks at an `info` reply of any version, before it is read strictly.

    Raises:
        UnexpectedReply: the daemon does not serve our schema; names both versions.
    """
    try:
        body = json.loads(info)
        served = body["schema_versions"]
        daemon = body["version"]
        known = SCHEMA_VERSION in served
    except (ValueError, KeyError, TypeError):
        raise UnexpectedReply("what answers is no axisync daemon", "check the endpoint") from None
    if not known:
        versions = ", ".join(str(version) for version in served)
        raise UnexpectedReply(
            f"the daemon (axisync {daemon}) serves schema {versions}, "
            f"this client (axisync {own_version()}) speaks schema {SCHEMA_VERSION}",
            "install the same version of axisync on both sides",
        )
