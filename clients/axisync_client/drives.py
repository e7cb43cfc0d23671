"""Drives: homing, and their objects for maintenance."""

from pydantic import ValidationError

from axisync_client.calls import Call
from axisync_client.client import Client
from axisync_client.errors import InvalidArgument, explain
from axisync_client.lease import Lease
from axisync_schemas.cell import Cell
from axisync_schemas.commands import DriveRequest, GroupRequest
from axisync_schemas.replies import DriveReply, GroupReply

Value = int | float | str
_PATIENCE_S = 10.0
"""For each drive beside its own time-out: to set it up, to halt it, and to lead it back."""


def home(lease: Lease, group: str | None = None) -> GroupReply:
    """Has the drives of an enabled group find their homes. They move by themselves, and nothing checks for collisions.

    Raises:
        Refused: with NOT_ENABLED, BUSY, or the reason for which home was not found.
    """
    name = lease._group(group)
    request = GroupRequest(group=name, lease=lease.token)
    timeout_s = _homing_s(lease._client.config(), name)
    return lease._command(Call("home", GroupReply, request, timeout_s, expires=True))


def read_object(client: Client, axis: str, name: str) -> DriveReply:
    """Reads an object of an axis's drive.

    Args:
        name: `0x6079`, `0x2002:1`, or a name of the EDS.
    """
    return client._ask(Call("drive", DriveReply, _request(axis=axis, object=name)))


def write_object(lease: Lease, axis: str, name: str, value: Value) -> DriveReply:
    """Writes an object of an axis's drive, and reads it back. The lease must be on its group, which is disabled."""
    request = _request(axis=axis, object=name, value=value, lease=lease.token)
    return lease._command(Call("drive", DriveReply, request, expires=True))


def group_of(cell: Cell, axis: str) -> str:
    """The group whose axis this is.

    Raises:
        InvalidArgument: no such axis.
    """
    for group in cell.groups:
        if any(one.name == axis for one in group.axes):
            return group.name
    raise InvalidArgument(f"no axis {axis!r} in {cell.name}", f"one of {', '.join(one.name for one in cell.axes)}")


def _homing_s(cell: Cell, group: str) -> float:
    """As long as all drives may take, one after the other; an unknown group is refused by the daemon."""
    try:
        axes = [cell.axes[i] for i in cell.axis_indices(group)]
    except KeyError:
        axes = []
    return _PATIENCE_S + sum(a.drive.homing.timeout_s + _PATIENCE_S for a in axes if a.drive.homing is not None)


def _request(**values: object) -> DriveRequest:
    try:
        return DriveRequest.model_validate(values)
    except ValidationError as error:
        raise InvalidArgument(explain(error)) from None
