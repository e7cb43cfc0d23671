"""The tick record as numpy sees it: a packed structured type whose bytes are the protobuf wire form.

Fixed-width fields that are always present, in the order of their numbers, make every `SetpointTick` of a cell one size:
tag and length bytes are constants between the values. The layout comes from the message's descriptor, so that
`ticks.proto` stays the only definition. (Protocol Buffers, "Encoding": tags, packed repeated fields, varints.)
"""

import struct
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from numpy.typing import NDArray

from axisync_schemas import ticks_pb2

PER_GROUP = frozenset({"plan_id", "path_s", "path_rate", "group_state"})
"""Repeated fields with one value a group; the others have one an axis."""

SIGNIFICAND_BITS = {"velocity": 28, "acceleration": 20, "jerk": 20}
"""What a record keeps of these doubles, so that a log packs well: 4e-9 and 1e-6 of a value are finer than a drive's
count. `position`, of which limits are judged, keeps all 52."""

Records = NDArray[np.void]
"""Structured records of a `TickLayout.dtype`; a shape of () is one record."""

_I64, _LENGTH_DELIMITED, _I32 = 1, 2, 5
_FIXED: dict[int, tuple[str, int]] = {
    FieldDescriptor.TYPE_DOUBLE: ("<f8", _I64),
    FieldDescriptor.TYPE_FIXED64: ("<u8", _I64),
    FieldDescriptor.TYPE_SFIXED64: ("<i8", _I64),
    FieldDescriptor.TYPE_FLOAT: ("<f4", _I32),
    FieldDescriptor.TYPE_FIXED32: ("<u4", _I32),
    FieldDescriptor.TYPE_SFIXED32: ("<i4", _I32),
}
"""numpy type and wire type of each protobuf type of fixed width."""

KEPT = {name: np.uint64(2**64 - 2 ** (52 - bits)) for name, bits in SIGNIFICAND_BITS.items()}
"""Masks for them: sign, exponent, and so many bits of the significand. What is cut is cut towards zero, so that a value
within a limit stays so."""

_TICK = ticks_pb2.SetpointTick.DESCRIPTOR
_FIELDS: tuple[FieldDescriptor, ...] = tuple(
    cast(FieldDescriptor, _TICK.fields_by_number[number]) for number in sorted(_TICK.fields_by_number)
)
_BATCH = ticks_pb2.SetpointBatch.DESCRIPTOR


class TickError(ValueError):
    """Bytes that are no record of this layout."""


def varint(value: int) -> bytes:
    """Base-128 varint of a number >= 0, shortest form."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _tag(number: int, wire_type: int) -> bytes:
    return varint(number << 3 | wire_type)


def _columns(field: FieldDescriptor, n_axes: int, n_groups: int) -> tuple[bytes, str, tuple[int, ...]]:
    """A field's constant prefix, and its values' type and shape."""
    code, wire_type = _FIXED[field.type]
    if not field.is_repeated:
        return _tag(field.number, wire_type), code, ()
    count = n_groups if field.name in PER_GROUP else n_axes
    length = varint(count * np.dtype(code).itemsize)
    return _tag(field.number, _LENGTH_DELIMITED) + length, code, (count,)


def shorten(values: NDArray[np.float64], name: str) -> None:
    """Cuts values of a derivative, in place, as records have them."""
    bits = values.view(np.uint64)
    np.bitwise_and(bits, KEPT[name], out=bits)


def shorten_rates(records: Records) -> None:
    """Cuts the derivatives of records of any shape."""
    for name in SIGNIFICAND_BITS:
        shorten(records[name], name)


class TickLayout:
    """The record of a cell with `n_axes` axes and `n_groups` groups, each at least 1.

    Attributes:
        dtype: packed; a field for each of the message's, and the constants before it as `<field>__tag`.
        size: bytes of a record, which are those of the serialised `SetpointTick`. 686 for 12 axes and 2 groups.
    """

    def __init__(self, n_axes: int, n_groups: int) -> None:
        if n_axes < 1 or n_groups < 1:
            raise ValueError(f"a record needs axes and groups, not {n_axes} and {n_groups}")
        self.n_axes, self.n_groups = n_axes, n_groups
        columns: list[tuple[Any, ...]] = []
        prefixes: dict[str, bytes] = {}
        for field in _FIELDS:
            prefix, code, shape = _columns(field, n_axes, n_groups)
            columns += [(f"{field.name}__tag", "u1", (len(prefix),)), (field.name, code, shape)]
            prefixes[field.name] = prefix
        self.fields = tuple(prefixes)
        self.dtype = np.dtype(columns)
        self.size = self.dtype.itemsize
        self._blank = np.zeros((), dtype=self.dtype)
        for name, prefix in prefixes.items():
            self._blank[f"{name}__tag"] = np.frombuffer(prefix, dtype=np.uint8)
        self._constant = np.concatenate([self._positions(f"{name}__tag") for name in self.fields])
        self._expected = np.frombuffer(self._blank.tobytes(), dtype=np.uint8)[self._constant]
        self._in_batch = _tag(_BATCH.fields_by_name["ticks"].number, _LENGTH_DELIMITED) + varint(self.size)
        self._sequence = _tag(_BATCH.fields_by_name["seq"].number, _I64)

    def _positions(self, name: str) -> NDArray[np.intp]:
        return self.offset(name) + np.arange(self.dtype[name].itemsize)

    def offset(self, name: str) -> int:
        """Byte at which the values of a field begin."""
        fields = self.dtype.fields
        assert fields is not None
        return int(fields[name][1])

    def new(self) -> Records:
        """A record of shape () with its tags in place and every value 0."""
        return self._blank.copy()

    def check(self, records: Records) -> None:
        """Verifies the constant bytes of records of any shape.

        Raises:
            TickError: another type, or constant bytes that differ, with the index of the first such record.
        """
        if records.dtype != self.dtype:
            raise TickError("records of another layout")
        octets = np.ascontiguousarray(records).reshape(-1).view(np.uint8).reshape(-1, self.size)
        wrong = (octets[:, self._constant] != self._expected).any(axis=1)
        if wrong.any():
            raise TickError(f"record {int(wrong.argmax())} is no tick of {self.n_axes} axes, {self.n_groups} groups")

    def decode(self, data: bytes | bytearray | memoryview) -> Records:
        """Records that follow each other without a gap, as a checked array of shape (n,) on the same memory.

        Raises:
            TickError: not a whole number of records, or not of this layout.
        """
        if len(data) % self.size:
            raise TickError(f"{len(data)} bytes are no whole number of records of {self.size}")
        records = np.frombuffer(data, dtype=self.dtype)
        self.check(records)
        return records

    def decode_many(self, data: bytes | bytearray | memoryview, offsets: Sequence[int] | NDArray[np.intp]) -> Records:
        """The records that begin at `offsets` of a buffer, a log's chunk for example; copied, shape (len(offsets),).

        Raises:
            TickError: a record does not fit the buffer, or is not of this layout.
        """
        begins = np.asarray(offsets, dtype=np.intp)
        if begins.size == 0:
            return np.empty(0, dtype=self.dtype)
        if begins.min() < 0 or begins.max() + self.size > len(data):
            raise TickError("a record lies outside its buffer")
        octets = np.frombuffer(data, dtype=np.uint8)
        rows = np.lib.stride_tricks.sliding_window_view(octets, self.size)[begins]
        records: Records = np.ascontiguousarray(rows).view(self.dtype).reshape(-1)
        self.check(records)
        return records

    def batch(self, records: Sequence[bytes], seq: int) -> bytes:
        """Wire form of the `SetpointBatch` of these records."""
        parts = [part for record in records for part in (self._in_batch, record)]
        return b"".join([*parts, self._sequence, struct.pack("<Q", seq)])

    def unbatch(self, data: bytes) -> tuple[Records, int]:
        """Records and number of a `SetpointBatch` made by `batch`.

        Raises:
            TickError: not such a batch.
        """
        tail = len(self._sequence) + 8
        step = len(self._in_batch) + self.size
        count, rest = divmod(len(data) - tail, step)
        if count < 0 or rest or data[-tail:-8] != self._sequence:
            raise TickError(f"{len(data)} bytes are no batch of records of {self.size}")
        (seq,) = struct.unpack("<Q", data[-8:])
        return self.decode_many(data, np.arange(count) * step + len(self._in_batch)), seq


def file_descriptor_set() -> bytes:
    """What a log needs to decode `SetpointTick` without this package: a serialised FileDescriptorSet."""
    files = FileDescriptorSet()
    ticks_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    return files.SerializeToString()
