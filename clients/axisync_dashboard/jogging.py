"""Hold-to-run: the request, and what a held pad means. The browser repeats it ten times a second; nobody else does."""

from typing import Literal

from pydantic import Field

from axisync_client.calls import Call
from axisync_schemas.base import Name
from axisync_schemas.cell import Cell
from axisync_schemas.commands import LeasedRequest
from axisync_schemas.replies import GroupReply

TTL_S = 0.3
"""The arm stops by itself when the browser was silent for so long: three refreshes."""
TIMEOUT_S = 0.25
LINEAR_M_S = 0.1
ANGULAR_RAD_S = 0.5
"""Full speed of the tool's pads."""

Space = Literal["joint", "tool", "base", "body"]
SPACES: dict[Space, str] = {"joint": "Joints", "tool": "Tool frame", "base": "Base frame", "body": "Body frame"}
DIRECTIONS = ("x", "y", "z", "about x", "about y", "about z")


class JogRequest(LeasedRequest):
    """`velocity`: rad/s of each axis, or m/s and rad/s of the tool along and about x, y, z."""

    group: Name
    space: Space
    velocity: tuple[float, ...]
    ttl_s: float = Field(default=TTL_S, gt=0.0)


def jog_call(group: str, space: Space, velocity: tuple[float, ...], token: str) -> Call[GroupReply]:
    """One refresh."""
    request = JogRequest(group=group, space=space, velocity=velocity, ttl_s=TTL_S, lease=token)
    return Call("jog", GroupReply, request, TIMEOUT_S, expires=True)


def pads_of(cell: Cell, group: str, space: Space) -> list[str]:
    """Names of what can be jogged."""
    return [cell.axes[i].name for i in cell.axis_indices(group)] if space == "joint" else list(DIRECTIONS)


def velocity_of(cell: Cell, group: str, space: Space, pad: int, sign: int, share: float) -> tuple[float, ...]:
    """The velocity that a pad stands for, at a share (0..1) of full speed.

    Raises:
        ValueError: there is no such pad.
    """
    if space == "joint":
        full = [cell.axes[i].limits.velocity for i in cell.axis_indices(group)]
    else:
        full = [LINEAR_M_S] * 3 + [ANGULAR_RAD_S] * 3
    if not 0 <= pad < len(full) or sign not in (1, -1):
        raise ValueError(f"there is no pad {pad}")
    return tuple(sign * share * value if i == pad else 0.0 for i, value in enumerate(full))
