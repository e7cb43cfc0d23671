"""Hold-to-run: the request, and what a held pad means. The browser repeats it ten times a second; nobody else does."""

from typing import Literal

from axisync_client import calls
from axisync_client.calls import Call
from axisync_schemas.cell import Cell
from axisync_schemas.replies import JogReply

TTL_S = 0.3
"""The arm stops by itself when the browser was silent for so long: three refreshes."""
TIMEOUT_S, RELEASE_S = 1.0, 10.0
"""For an answer: the first one comes when the way is planned, that of a release when the group stands."""
LINEAR_M_S = 0.1
ANGULAR_RAD_S = 0.5
"""Full speed of the tool's pads."""

Space = Literal["joint", "tool", "base", "body"]
SPACES: dict[Space, str] = {"joint": "Joints", "tool": "Tool frame", "base": "Base frame", "body": "Body frame"}
DIRECTIONS = ("x", "y", "z", "about x", "about y", "about z")


def jog_call(group: str, space: Space, velocity: tuple[float, ...], token: str) -> Call[JogReply]:
    """One refresh."""
    return calls.jog(group, space, velocity, TTL_S, token, TIMEOUT_S)


def release_call(cell: Cell, group: str, space: Space, token: str) -> Call[JogReply]:
    """The pad was let go; answered when the group stands."""
    return calls.jog(group, space, (0.0,) * len(pads_of(cell, group, space)), TTL_S, token, RELEASE_S)


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
