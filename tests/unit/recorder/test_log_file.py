"""One MCAP file: readable by others, whole chunks at once in the kernel, readable wherever it is cut."""

import errno
import json
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import TickLayout
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.log_file import CHUNK_BYTES, LogFile, new_file
from support.feeder import Feeder
from support.logread import LogError, read_log
from support.recording import CELL

CLOCKS = ClockPair(monotonic_ns=5_000_000_000, wall_ns=1_700_000_000_123_456_789)


@pytest.fixture
def cell() -> Cell:
    return read_cell(CELL)[0]


@pytest.fixture
def feeder(cell: Cell) -> Feeder:
    layout = TickLayout(len(cell.axes), len(cell.groups))
    ring = TickRing(bytearray(TickRing.size(layout, 2)), layout, 2)
    return Feeder(cell, None, ring, origin_ns=CLOCKS.monotonic_ns)  # type: ignore[arg-type]


@pytest.fixture
def file(tmp_path: Path, cell: Cell) -> Iterator[LogFile]:
    one = LogFile(tmp_path, cell, CELL.read_text(), CLOCKS)
    yield one
    one.abandon()


def add(file: LogFile, feeder: Feeder, first: int, last: int) -> list[int]:
    """Ticks first..last; those at which a chunk had reached the kernel."""
    reached = []
    for tick in range(first, last + 1):
        record = feeder.record(tick)
        if file.add_tick(record.tobytes(), tick, int(record["cycle_start_ns"])):
            reached.append(tick)
    return reached


def finished(file: LogFile, feeder: Feeder, ticks: int = 1000) -> Path:
    add(file, feeder, 1, ticks)
    file.add_json("/events", CLOCKS.monotonic_ns + 10**9, b'{"kind": "realtime", "now_s": 6.0}')
    file.finish()
    return file.path


def test_the_name_tells_cell_and_time_and_is_never_taken_twice(tmp_path: Path) -> None:
    names = [new_file(tmp_path, "eod", CLOCKS) for _ in range(3)]
    for one in names:
        one.close()
    assert [one.path.name for one in names] == [
        "eod-20231114T221320Z.mcap",
        "eod-20231114T221320Z-2.mcap",
        "eod-20231114T221320Z-3.mcap",
    ]


def test_the_decoder_of_others_reads_what_numpy_reads(file: LogFile, feeder: Feeder) -> None:
    path = finished(file, feeder)
    log = read_log(path)
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        messages = [decoded for _, _, _, decoded in reader.iter_decoded_messages(topics=["/setpoints"])]
    assert len(messages) == len(log.ticks) == 1000
    for name in log.layout.fields:
        decoded = np.array([getattr(message, name) for message in messages], dtype=log.layout.dtype[name].base)
        assert decoded.tobytes() == np.ascontiguousarray(log.ticks[name]).tobytes(), name


def test_summary_index_and_statistics_are_there(file: LogFile, feeder: Feeder) -> None:
    path = finished(file, feeder)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 1001 + 100
        assert len(summary.chunk_indexes) > 5
        topics = {channel.topic: channel for channel in summary.channels.values()}
        late = list(reader.iter_messages(topics=["/setpoints"], starting_at=CLOCKS.wall_ns + 10**9))
    assert len(late) == 1000 - 500 + 1
    assert set(topics) == {"/setpoints", "/joint_states", "/requests", "/plans", "/events", "/log"}
    assert topics["/setpoints"].metadata["axes"].split()[0] == "kingkong.1"
    schemas = {topic: summary.schemas[channel.schema_id] for topic, channel in topics.items()}
    assert (schemas["/setpoints"].name, schemas["/setpoints"].encoding) == ("axisync.SetpointTick", "protobuf")
    for topic in ("/requests", "/plans", "/events"):
        assert schemas[topic].encoding == "jsonschema"
        assert json.loads(schemas[topic].data)["type"] == "object"


def test_the_cell_file_versions_and_both_clocks_are_attached(file: LogFile, feeder: Feeder) -> None:
    log = read_log(finished(file, feeder))
    assert log.attachments["cell.toml"].decode() == CELL.read_text()
    versions = json.loads(log.attachments["versions.json"])
    assert versions["python"].startswith("3.")
    assert {"kernel", "mcap", "numpy", "protobuf"} <= set(versions)
    clocks = log.metadata["axisync.clocks"]
    assert int(clocks["wall_ns"]) - int(clocks["monotonic_ns"]) == int(clocks["offset_ns"])
    assert clocks["wall_time"] == "2023-11-14T22:13:20.123457+00:00"


def test_log_times_are_the_instants_of_the_grid_on_the_wall_clock(file: LogFile, feeder: Feeder) -> None:
    log = read_log(finished(file, feeder))
    assert log.log_times_ns[0] == CLOCKS.wall_ns + 2_000_000
    assert (np.diff(log.log_times_ns) == 2_000_000).all()


def test_a_chunk_is_in_the_kernel_when_it_is_said_to_be(file: LogFile, feeder: Feeder) -> None:
    size_before, last_before = file.path.stat().st_size, 0
    for tick in range(1, 400):
        record = feeder.record(tick)
        if file.add_tick(record.tobytes(), tick, int(record["cycle_start_ns"])):
            assert file.path.stat().st_size > size_before
            log = read_log(file.path)
            assert log.ticks["tick"].tolist() == list(range(1, tick + 1))
            assert not log.complete
            size_before, last_before = file.path.stat().st_size, tick
        else:
            assert file.path.stat().st_size == size_before
    assert last_before > 300


def test_chunks_are_small(file: LogFile, feeder: Feeder) -> None:
    reached = add(file, feeder, 1, 1000)
    steps = np.diff([0, *reached])
    assert (steps * 686 <= CHUNK_BYTES).all()
    assert steps.max() * 0.002 < 0.25


def test_flush_ends_a_chunk_and_does_nothing_without_messages(file: LogFile, feeder: Feeder) -> None:
    assert not file.flush()
    add(file, feeder, 1, 3)
    assert file.flush()
    assert len(read_log(file.path).ticks) == 3
    assert not file.flush()


def test_a_file_cut_anywhere_gives_a_beginning_without_a_gap(file: LogFile, feeder: Feeder, tmp_path: Path) -> None:
    whole = finished(file, feeder, 600).read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for size in (*range(0, len(whole), 3989), len(whole) - 1):
        cut.write_bytes(whole[:size])
        try:
            log = read_log(cut)
        except LogError:
            assert size < 8192  # Not even the cell file.
            continue
        assert not log.complete
        assert log.ticks["tick"].tolist() == list(range(1, len(log.ticks) + 1))
        counts.append(len(log.ticks))
    assert counts == sorted(counts)
    assert counts[-1] == 600
    assert len(set(counts)) > 5


def test_a_damaged_chunk_is_not_taken_for_a_short_file(file: LogFile, feeder: Feeder, tmp_path: Path) -> None:
    data = bytearray(finished(file, feeder, 600).read_bytes())
    data[len(data) // 2] ^= 0xFF
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    with pytest.raises(Exception, match=r"damaged|decompress|zstd|corrupt"):
        read_log(damaged)


def test_one_tick_with_two_contents_is_an_error(file: LogFile, feeder: Feeder) -> None:
    add(file, feeder, 1, 5)
    record = feeder.record(5)
    record["position"][0] += 1e-9
    file.add_tick(record.tobytes(), 5, int(record["cycle_start_ns"]))
    file.finish()
    with pytest.raises(LogError, match="tick 5 is in the log twice"):
        read_log(file.path)


def test_abandoning_keeps_whole_chunks_and_removes_a_file_without_any(
    tmp_path: Path, cell: Cell, feeder: Feeder
) -> None:
    empty = LogFile(tmp_path, cell, CELL.read_text(), CLOCKS)
    add(empty, feeder, 1, 3)
    empty.abandon()
    assert not empty.path.exists()
    other = LogFile(tmp_path, cell, CELL.read_text(), CLOCKS)
    reached = add(other, feeder, 1, 250)
    size = other.path.stat().st_size
    other.abandon()
    assert other.path.stat().st_size == size
    assert len(read_log(other.path).ticks) == reached[-1]


def test_abandoning_cuts_a_torn_chunk_off(file: LogFile, feeder: Feeder, monkeypatch: pytest.MonkeyPatch) -> None:
    reached = add(file, feeder, 1, 150)
    whole = file.path.stat().st_size
    write = os.write

    def half(fd: int, data: memoryview) -> int:
        if len(data) < 1000:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(fd, data[: len(data) // 2])

    monkeypatch.setattr(os, "write", half)
    with pytest.raises(OSError, match="No space"):
        add(file, feeder, 151, 300)
    monkeypatch.undo()
    assert file.path.stat().st_size > whole
    file.abandon()
    assert file.path.stat().st_size == whole
    assert len(read_log(file.path).ticks) == reached[-1]
