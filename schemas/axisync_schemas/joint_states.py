"""`/joint_states`: measured positions and velocities as foxglove.JointStates, so that 3D viewers move a robot by them.

Schema: https://docs.foxglove.dev/docs/sdk/schemas/joint-states (protobuf); its field numbers are in `_FIELDS`.
"""

import struct

import numpy as np
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Field
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet

from axisync_schemas.cell import Cell
from axisync_schemas.ticks import TickLayout, varint
from axisync_schemas.topics import JOINT_STATES_HZ

SCHEMA = "foxglove.JointStates"
_FIELDS = (("position", 2), ("velocity", 3), ("acceleration", 4), ("effort", 5))
_POSITION, _VELOCITY = b"\x11", b"\x19"
"""Tags of fields 2 and 3, wire type I64."""
_SECOND = 1_000_000_000


class JointStates:
    """Makes a message of every n-th tick; velocity is the difference to the message before, where there was one.

    Values are rounded to float32 (6e-8 of a turn's worth at most): that is plenty for a picture, and packs to half.
    """

    def __init__(self, cell: Cell, layout: TickLayout) -> None:
        self._every = max(1, round(1.0 / (JOINT_STATES_HZ * cell.period)))
        self._span_s = self._every * cell.period
        self._offset = layout.offset("position_actual")
        self._count = len(cell.axes)
        self._names = [b"\x0a" + _sized(axis.name.encode()) for axis in cell.axes]
        self._last_tick: int | None = None
        self._last = np.zeros(self._count)

    def message(self, tick: int, record: bytes, wall_ns: int) -> bytes | None:
        """The message of this tick, or None where it is not one of every n-th."""
        if tick % self._every:
            return None
        position = np.frombuffer(record, "<f8", self._count, self._offset)
        known = self._last_tick == tick - self._every
        velocity = (position - self._last) / self._span_s if known else None
        self._last_tick, self._last = tick, position
        parts = [b"\x0a", _sized(_timestamp(wall_ns))]
        rates = velocity.astype(np.float32).tolist() if velocity is not None else [None] * self._count
        for name, angle, rate in zip(self._names, position.astype(np.float32).tolist(), rates, strict=True):
            parts += [b"\x12", _sized(_joint(name, angle, rate))]
        return b"".join(parts)


def _joint(name: bytes, position: float, velocity: float | None) -> bytes:
    rest = b"" if velocity is None else _VELOCITY + struct.pack("<d", velocity)
    return name + _POSITION + struct.pack("<d", position) + rest


def _timestamp(wall_ns: int) -> bytes:
    seconds, nanos = divmod(wall_ns, _SECOND)
    return b"\x08" + varint(seconds) + b"\x10" + varint(nanos)


def _sized(body: bytes) -> bytes:
    return varint(len(body)) + body


def schema() -> bytes:
    """A serialised FileDescriptorSet of foxglove.JointStates and what it needs."""
    files = FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    _joint_state(files.file.add())
    _joint_states(files.file.add())
    return files.SerializeToString()


def _joint_state(file: FileDescriptorProto) -> None:
    file.name, file.package, file.syntax = "foxglove/JointState.proto", "foxglove", "proto3"
    message = file.message_type.add(name="JointState")
    message.field.add(name="name", number=1, type=Field.TYPE_STRING, label=Field.LABEL_OPTIONAL)
    for index, (name, number) in enumerate(_FIELDS):
        message.oneof_decl.add(name=f"_{name}")
        message.field.add(
            name=name, number=number, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL, proto3_optional=True,
            oneof_index=index,
        )  # fmt: skip


def _joint_states(file: FileDescriptorProto) -> None:
    file.name, file.package, file.syntax = "foxglove/JointStates.proto", "foxglove", "proto3"
    file.dependency.extend(["foxglove/JointState.proto", "google/protobuf/timestamp.proto"])
    message = file.message_type.add(name="JointStates")
    message.field.add(
        name="timestamp", number=1, type=Field.TYPE_MESSAGE, label=Field.LABEL_OPTIONAL,
        type_name=".google.protobuf.Timestamp",
    )  # fmt: skip
    message.field.add(
        name="joints", number=2, type=Field.TYPE_MESSAGE, label=Field.LABEL_REPEATED, type_name=".foxglove.JointState"
    )
