"""The daemon's Zenoh session: a router for its clients, on loopback, where nobody else can serve or publish."""

import ipaddress
import json
import re
from typing import Any

import zenoh

from axisync_schemas.keys import ROOT

BLOCKED_CLOSE_US = 100_000
"""A client that leaves replies unread for this long is disconnected, so that it cannot hold up the others."""
MAX_MESSAGE_BYTES = 16 * 1024 * 1024
"""Above this Zenoh drops a message while it is put together; below it, too long requests get a typed answer."""
MAX_SESSIONS = 128

_ENDPOINT = re.compile(r"^tcp/(?P<host>\[[0-9A-Fa-f:.]+\]|[^\[\]:/]+):(?P<port>\d{1,5})$")


class ListenError(ValueError):
    """The listen address is refused; the message is one sentence for the user."""


def check_listen(listen: str) -> None:
    """Without authentication only loopback addresses are served.

    Raises:
        ListenError: anything else.
    """
    match = _ENDPOINT.match(listen)
    if match is None or int(match["port"]) > 65535:
        raise ListenError(f"--listen {listen!r} is not of the form tcp/127.0.0.1:7447.")
    host = match["host"].strip("[]")
    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        raise ListenError(
            f"--listen {listen!r} is refused: without authentication only loopback addresses are served "
            "(tcp/127.0.0.1:PORT)."
        )


def settings(listen: str) -> dict[str, Any]:
    """What differs from Zenoh's defaults, by configuration key."""
    return {
        "mode": "router",
        "listen/endpoints": [listen],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # there is nobody to wait for: half a second less until the first query is served
        "timestamping/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/unicast/max_sessions": MAX_SESSIONS,
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": BLOCKED_CLOSE_US,
        "access_control": access_control(),
    }


def access_control() -> dict[str, Any]:
    """Whoever connects may ask and listen; only the daemon may serve, publish and be alive.

    A list of what is allowed, not of what is denied: Zenoh matches a rule by inclusion, and a queryable on `**` would
    not be included in a rule that denies `cmd/**`, yet would receive its queries.
    """
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [
            {
                "id": "ask and listen",
                "permission": "allow",
                "flows": ["ingress"],
                "messages": ["query", "declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"],
                "key_exprs": ["**"],
            },
            {
                "id": "the daemon's own",
                "permission": "allow",
                "flows": ["egress"],
                "messages": ["put", "reply", "declare_queryable", "liveliness_token"],
                "key_exprs": [f"{ROOT}/**"],
            },
        ],
        "subjects": [{"id": "anyone"}],
        "policies": [{"rules": ["ask and listen", "the daemon's own"], "subjects": ["anyone"]}],
    }


def open_session(listen: str) -> zenoh.Session:
    """Opens the session; close it on every way out, or the process hangs at its end.

    Raises:
        ListenError: the address is refused, or cannot be listened on.
    """
    check_listen(listen)
    config = zenoh.Config()
    for key, value in settings(listen).items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        reason = "the address is in use" if "in use" in str(error) else str(error).split("\n")[0][:200]
        raise ListenError(f"cannot listen on {listen}: {reason}") from None
