"""`drive`: from the object that a maintainer names to its bytes, and back to a value."""

from collections.abc import Callable

from axisync_schemas import eds
from axisync_schemas.cell import Cell
from axisync_schemas.cell_drive import object_key
from axisync_schemas.commands import DriveRequest, Request
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.internal import ControllerReply, DriveCommand
from axisync_schemas.replies import DriveReply
from axisync_service.actioner import admission
from axisync_service.actioner.controller_calls import ControllerCalls
from axisync_service.actioner.desk import Call, Desk
from axisync_service.actioner.leases import Leases
from axisync_service.actioner.world import World
from axisync_service.drives.configuration import written_indices

Key = tuple[int, int]


class DriveObjects:
    """Reads and writes objects of drives. A write needs the lease of the axis's group; a read needs none."""

    def __init__(self, cell: Cell, desk: Desk, leases: Leases, calls: ControllerCalls) -> None:
        self._cell, self._desk, self._leases, self._calls = cell, desk, leases, calls

    def handle(self, call: Call, world: World) -> None:
        """Takes in a `drive`.

        Raises:
            Refusal: no such axis or object, a value that does not fit, an object that is not for writing, no lease.
        """
        request = _as_drive(call.request)
        axis = self._axis(request.axis)
        key = _key(request.object)
        if request.value is not None:
            self._check_write(axis, key, request, world)
        admission.check_controller(world)
        data, value = _packed(key, request.value)
        index, sub = key
        command = DriveCommand(ref=self._calls.new_ref(), axis=axis, index=index, sub=sub, data=data, value=value)
        found: list[str] = []

        def done(then: World) -> None:
            self._desk.reply(call, self._reply(call, request.axis, key, found[0], then), then.now_ns)

        self._calls.send(call, command, world.now_ns, done=done, heard=_into(found))

    def _axis(self, name: str) -> int:
        names = [axis.name for axis in self._cell.axes]
        if name not in names:
            fault = {"path": "axis", "message": f"no axis {name!r} in this cell", "value": name}
            raise Refusal(
                ErrorCode.INVALID_REQUEST,
                f"{fault['message']}: the axes are {', '.join(names)}",
                errors=[fault],
                axes=names,
            )
        return names.index(name)

    def _check_write(self, axis: int, key: Key, request: DriveRequest, world: World) -> None:
        groups = self._cell.group_names
        member = next(i for i, name in enumerate(groups) if axis in self._cell.axis_indices(name))
        self._leases.verify(request.lease, (member,), world.now_ns)
        entry = eds.drive_dictionary().entries.get(key)
        if entry is not None and not entry.writable:
            raise Refusal(ErrorCode.INVALID_REQUEST, f"{entry} is read-only", object=request.object)
        if key[0] in written_indices(self._cell, self._cell.axes[axis]):
            why = (
                f"{eds.drive_dictionary().describe(*key)} is written by the service itself: "
                "change the cell file, and start the service again"
            )
            raise Refusal(ErrorCode.INVALID_REQUEST, why, object=request.object)

    def _reply(self, call: Call, axis: str, key: Key, data: str, world: World) -> DriveReply:
        entry = eds.drive_dictionary().entries.get(key)
        return DriveReply(
            request_id=call.request_id,
            now_s=world.now_s,
            axis=axis,
            object=f"0x{key[0]:04X}:{key[1]}",
            name=entry.name if entry is not None else None,
            value=_value(entry, bytes.fromhex(data)),
            data=data,
        )


def _key(text: str) -> Key:
    """By number, or by a name of the EDS."""
    if text.lower().startswith("0x"):
        try:
            return object_key(text)
        except ValueError as error:
            raise _wrong("object", str(error), text) from None
    try:
        entry = eds.drive_dictionary().find(text)
    except eds.EdsError as error:
        raise _wrong("object", str(error), text) from None
    return entry.index, entry.sub


def _packed(key: Key, value: int | float | str | None) -> tuple[str | None, int | None]:
    """The value as bytes by the object's type; of an object that the EDS does not have, a number as it is."""
    entry = eds.drive_dictionary().entries.get(key)
    if value is None:
        return None, None
    if entry is None:
        if not isinstance(value, int):
            why = f"0x{key[0]:04X}:{key[1]} is not in the EDS: only whole numbers can be written to it"
            raise _wrong("value", why, value)
        return None, value
    try:
        return entry.pack(value).hex(), None
    except eds.EdsError as error:
        raise _wrong("value", str(error), value) from None


def _value(entry: eds.Entry | None, data: bytes) -> int | float | str | None:
    """Of a known type, or else an unsigned number of up to 8 bytes."""
    if entry is None:
        return int.from_bytes(data, "little") if len(data) <= 8 else None
    try:
        value = entry.unpack(data)
    except eds.EdsError:
        return None
    return None if isinstance(value, bytes) else value


def _into(found: list[str]) -> Callable[[ControllerReply], None]:
    return lambda reply: found.append(reply.data or "")


def _wrong(path: str, message: str, value: object) -> Refusal:
    fault = {"path": path, "message": message, "value": value}
    return Refusal(ErrorCode.INVALID_REQUEST, f"{path}: {message}", errors=[fault])


def _as_drive(request: Request) -> DriveRequest:
    if not isinstance(request, DriveRequest):
        raise TypeError(f"{type(request).__name__} is no DriveRequest")
    return request
