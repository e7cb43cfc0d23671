"""The tick record: its bytes are protobuf's, its layout is the descriptor's."""

import struct
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st

import axisync_schemas
from axisync_schemas import ticks_pb2
from axisync_schemas.ticks import (
    PER_GROUP,
    SIGNIFICAND_BITS,
    Records,
    TickError,
    TickLayout,
    file_descriptor_set,
    shorten_rates,
    varint,
)

SHAPES = [(1, 1), (6, 1), (12, 2), (15, 3), (16, 16), (48, 2), (64, 16), (2048, 1)]
"""From 16 axes on, a field of 8-byte values needs two bytes for its length; from 2048 on three."""


def filled(layout: TickLayout, seed: int = 0) -> Records:
    """A record whose values are random bits, NaN among them left out."""
    rng = np.random.default_rng(seed)
    record = layout.new()
    for name in layout.fields:
        column = record[name]
        if column.dtype.kind == "f":
            record[name] = rng.normal(size=column.shape) * 10.0 ** rng.integers(-300, 300, column.shape)
        else:
            limits = np.iinfo(column.dtype)
            record[name] = rng.integers(limits.min, limits.max, column.shape, column.dtype, endpoint=True)
    return record


@pytest.mark.parametrize(("axes", "groups"), SHAPES)
def test_bytes_are_those_of_protobuf(axes: int, groups: int) -> None:
    layout = TickLayout(axes, groups)
    record = filled(layout)
    message = ticks_pb2.SetpointTick()
    for name in layout.fields:
        if record[name].shape == ():
            setattr(message, name, record[name].item())
        else:
            getattr(message, name).extend(record[name].tolist())
    assert message.SerializeToString(deterministic=True) == record.tobytes()
    assert layout.size == len(record.tobytes())


@pytest.mark.parametrize(("axes", "groups"), SHAPES)
def test_protobuf_reads_a_blank_record_with_every_field_present(axes: int, groups: int) -> None:
    message = ticks_pb2.SetpointTick.FromString(TickLayout(axes, groups).new().tobytes())
    assert [field.number for field, _ in message.ListFields()] == list(range(1, 16))
    for field, value in message.ListFields():
        if field.is_repeated:
            assert list(value) == [0] * (groups if field.name in PER_GROUP else axes)
        else:
            assert value == 0


def test_size_for_twelve_axes_and_two_groups() -> None:
    assert TickLayout(12, 2).size == 686


def test_first_bytes_of_a_record() -> None:
    record = TickLayout(2, 1).new()
    record["tick"] = 7
    record["lateness_ns"] = -2
    record["position"] = [1.0, -0.5]
    octets = record.tobytes()
    assert octets[:9] == b"\x09" + (7).to_bytes(8, "little")
    assert octets[18:27] == b"\x19" + (-2).to_bytes(8, "little", signed=True)
    assert octets[27:32] == b"\x25\0\0\0\0"
    assert octets[32:50] == b"\x2a\x10" + struct.pack("<2d", 1.0, -0.5)


def test_a_layout_needs_axes_and_groups() -> None:
    with pytest.raises(ValueError, match="needs axes and groups"):
        TickLayout(0, 1)


def test_new_records_are_independent() -> None:
    layout = TickLayout(3, 1)
    one, other = layout.new(), layout.new()
    one["position"] = 5.0
    assert other["position"].tolist() == [0.0] * 3


def test_decode_shares_memory_and_checks() -> None:
    layout = TickLayout(6, 1)
    data = bytearray(filled(layout, 1).tobytes() + filled(layout, 2).tobytes())
    records = layout.decode(data)
    records["tick"][1] = 99
    assert layout.decode(data)["tick"][1] == 99
    with pytest.raises(TickError, match="no whole number"):
        layout.decode(bytes(data[:-1]))
    data[layout.size] ^= 1
    with pytest.raises(TickError, match=r"record 1 is no tick of 6 axes, 1 groups"):
        layout.decode(data)


def test_every_constant_byte_is_checked() -> None:
    layout = TickLayout(16, 2)
    good = layout.new().tobytes()
    constant = [i for i, byte in enumerate(filled(layout).tobytes()) if byte == good[i] and byte != 0]
    assert len(constant) >= 26
    for position in constant:
        broken = bytearray(good)
        broken[position] ^= 0x10
        with pytest.raises(TickError):
            layout.decode(broken)


def test_records_of_another_layout_are_refused() -> None:
    with pytest.raises(TickError, match="another layout"):
        TickLayout(6, 1).check(TickLayout(6, 2).new())


def test_decode_many_finds_records_between_other_things() -> None:
    layout = TickLayout(12, 2)
    parts, offsets, at = [], [], 0
    for number in range(20):
        gap = b"\xff" * (number % 7)
        parts += [gap, filled(layout, number).tobytes()]
        offsets.append(at + len(gap))
        at += len(gap) + layout.size
    data = b"".join(parts)
    records = layout.decode_many(data, offsets)
    assert records.tobytes() == b"".join(parts[1::2])
    assert len(layout.decode_many(data, [])) == 0
    with pytest.raises(TickError, match="outside"):
        layout.decode_many(data, [len(data) - layout.size + 1])
    with pytest.raises(TickError, match="outside"):
        layout.decode_many(data, [-1])


@pytest.mark.parametrize("axes", [2, 12, 48])
def test_a_batch_is_a_setpoint_batch(axes: int) -> None:
    layout = TickLayout(axes, 2)
    records = [filled(layout, seed).tobytes() for seed in range(10)]
    wire = layout.batch(records, 2**40)
    message = ticks_pb2.SetpointBatch.FromString(wire)
    assert message.SerializeToString(deterministic=True) == wire
    assert [tick.SerializeToString(deterministic=True) for tick in message.ticks] == records
    assert message.seq == 2**40
    back, seq = layout.unbatch(wire)
    assert (back.tobytes(), seq) == (b"".join(records), 2**40)


def test_an_empty_batch_and_a_broken_one() -> None:
    layout = TickLayout(2, 1)
    records, seq = layout.unbatch(layout.batch([], 5))
    assert (len(records), seq) == (0, 5)
    for broken in (b"", b"\0" * 9, layout.batch([layout.new().tobytes()], 1)[1:]):
        with pytest.raises(TickError):
            layout.unbatch(broken)


@given(st.integers(0, 2**64 - 1))
def test_varints(value: int) -> None:
    octets = varint(value)
    assert sum((byte & 0x7F) << 7 * i for i, byte in enumerate(octets)) == value
    assert all(byte & 0x80 for byte in octets[:-1])
    assert not octets[-1] & 0x80
    assert len(octets) == 1 or octets[-1]


def test_the_descriptor_set_alone_reads_a_record() -> None:
    """What a plotting program gets with the log."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(file_descriptor_set()).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("axisync.SetpointTick"))
    record = filled(TickLayout(12, 2))
    assert kind.FromString(record.tobytes()).SerializeToString(deterministic=True) == record.tobytes()


def test_the_committed_python_is_that_of_the_proto(tmp_path: Path) -> None:
    from grpc_tools import protoc  # type: ignore[import-untyped]

    schemas = Path(axisync_schemas.__file__).parents[1]
    status = protoc.main(
        ["protoc", f"-I{schemas}", f"--python_out={tmp_path}", f"--pyi_out={tmp_path}", "axisync_schemas/ticks.proto"]
    )
    assert status == 0
    made = tmp_path / "axisync_schemas"
    for name in ("ticks_pb2.py", "ticks_pb2.pyi"):
        assert _code(made / name) == _code(schemas / "axisync_schemas" / name), f"{name} is stale: make schemas"


def _code(path: Path) -> list[str]:
    """Without the generator's version, which differs from one release to the next."""
    lines = path.read_text().splitlines()
    return [line for line in lines if "Protobuf Python Version" not in line and not line.strip().rstrip(",").isdigit()]


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(sorted(SIGNIFICAND_BITS)))
def test_derivatives_are_cut_towards_zero(value: float, name: str) -> None:
    records = np.zeros(3, dtype=TickLayout(2, 1).dtype)
    records[name] = value
    shorten_rates(records)
    bits = SIGNIFICAND_BITS[name]
    kept = float(records[name][1, 1])
    assert np.unique(records[name]).size == 1
    assert abs(kept) <= abs(value)
    assert abs(value - kept) <= max(2.0**-bits * abs(value), 2.0 ** (-1022 - bits))
    assert (abs(struct.unpack("<q", struct.pack("<d", kept))[0]) & (1 << 52 - bits) - 1) == 0


def test_positions_are_not_cut() -> None:
    layout = TickLayout(12, 2)
    record = filled(layout)
    before = record.copy()
    shorten_rates(record)
    changed = {name for name in layout.fields if record[name].tobytes() != before[name].tobytes()}
    assert changed == set(SIGNIFICAND_BITS)
