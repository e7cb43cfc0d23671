"""Objects of drives, for maintenance."""

from pydantic import ValidationError

from axisync_client.calls import Call
from axisync_client.client import Client
from axisync_client.errors import InvalidArgument, explain
from axisync_client.lease import Lease
from axisync_schemas.cell import Cell
from axisync_schemas.commands import DriveRequest
from axisync_schemas.replies import DriveReply

Value = int | float | str


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


def _request(**values: object) -> DriveRequest:
    try:
        return DriveRequest.model_validate(values)
    except ValidationError as error:
        raise InvalidArgument(explain(error)) from None
