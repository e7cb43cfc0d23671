"""What other people's programs rely on: indexes, statistics, schemas; the layout's paths; the lines of docs/log.md."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import SeekingReader
from mcap.summary import Summary
from mcap_protobuf.decoder import DecoderFactory

from axisync_review.story import MODELS
from axisync_schemas import ticks_pb2
from axisync_schemas.enumerations import GroupState
from support.logread import read_log

ROOT = Path(__file__).parents[3]
LAYOUT = ROOT / "deploy/foxglove-layout.json"
PAGE = ROOT / "docs/log.md"


@pytest.fixture(scope="module")
def summary(good_log: Path) -> Summary:
    """As any reader that seeks finds it at the file's end."""
    with good_log.open("rb") as stream:
        found = SeekingReader(stream, validate_crcs=True).get_summary()
    assert found is not None
    return found


def test_statistics_and_indexes(summary: Summary, good_log: Path) -> None:
    log = read_log(good_log)
    assert summary.statistics is not None
    topics = {channel.id: channel.topic for channel in summary.channels.values()}
    counts = {topics[channel]: count for channel, count in summary.statistics.channel_message_counts.items()}
    assert counts.pop("/joint_states") == len(log.ticks) // 10
    assert counts == {"/setpoints": len(log.ticks), "/requests": 1, "/plans": 1, "/events": 2}
    assert summary.statistics.chunk_count == len(summary.chunk_indexes)
    assert summary.statistics.message_start_time == min(chunk.message_start_time for chunk in summary.chunk_indexes)
    assert {index.name for index in summary.attachment_indexes} == {"cell.toml", "versions.json"}
    assert [index.name for index in summary.metadata_indexes] == ["axisync.clocks", "axisync.machine"]


def test_a_reader_finds_one_instant_by_the_indexes(good_log: Path) -> None:
    log = read_log(good_log)
    with good_log.open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = reader.iter_decoded_messages(topics=["/setpoints"], starting_at=int(log.log_times_ns[900]))
        tick = next(found).decoded_message
    assert tick.tick == log.ticks["tick"][900]
    assert list(tick.position) == log.ticks["position"][900].tolist()


def test_schemas(summary: Summary) -> None:
    """The descriptor is complete in itself; each JSON Schema is one, and has the properties of its model."""
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        if channel.message_encoding == "protobuf":
            files = FileDescriptorSet.FromString(schema.data)
            assert schema.name == {"/setpoints": "axisync.SetpointTick"}.get(channel.topic, "foxglove.JointStates")
            assert {name for file in files.file for name in file.dependency} <= {file.name for file in files.file}
            assert channel.topic != "/setpoints" or channel.metadata["axes"].split()[0] == "kingkong.1"
        else:
            properties = json.loads(schema.data)["properties"]
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert set(properties) == set(MODELS[channel.topic].model_fields)


# --- the layout -----------------------------------------------------------------------------------------------------


def strings(value: Any) -> list[str]:
    """Every string in a JSON value."""
    if isinstance(value, dict):
        return [text for one in value.values() for text in strings(one)]
    if isinstance(value, list):
        return [text for one in value for text in strings(one)]
    return [value] if isinstance(value, str) else []


def test_the_layout_shows_what_there_is(good_log: Path) -> None:
    layout = json.loads(LAYOUT.read_text())
    shown = strings(layout["layout"])
    assert set(layout["configById"]) == {text for text in shown if "!" in text}
    paths = [text for text in strings(layout["configById"]) if text.startswith("/")]
    assert len(paths) > 50
    ticks = read_log(good_log).ticks
    for path in paths:
        match = re.fullmatch(r"(/\w+)(?:\.(\w+)(?:\[(\d+)\])?)?", path)
        assert match is not None, path
        topic, field, index = match.groups()
        if topic != "/setpoints":
            assert field is None or field in MODELS[topic].model_fields, path
            continue
        assert field in ticks_pb2.SetpointTick.DESCRIPTOR.fields_by_name, path
        assert (index is None) == (ticks[field].ndim == 1), path
        assert index is None or int(index) < ticks[field].shape[1], path


# --- the page -------------------------------------------------------------------------------------------------------


def test_the_ten_lines_run(good_log: Path, tmp_path: Path) -> None:
    """As they stand in docs/log.md, on their own."""
    match = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert match is not None
    lines = match[1]
    assert len([line for line in lines.splitlines() if line.strip()]) <= 10
    script = tmp_path / "lines.py"
    script.write_text(lines)
    printed = subprocess.run([sys.executable, script, good_log], capture_output=True, text=True, check=True)
    ticks = read_log(good_log).ticks
    peak = np.abs(ticks["velocity"]).max()
    assert printed.stdout.startswith(f"{len(ticks)} ticks of kingkong.1 kingkong.2")
    assert printed.stdout.endswith(f"at most {peak:.4f} rad/s\n")


def test_the_page_names_every_field_and_state() -> None:
    text = PAGE.read_text()
    for field in ticks_pb2.SetpointTick.DESCRIPTOR.fields:
        assert f"`{field.name}`" in text
    for state in GroupState:
        assert f"{int(state)} {state.label}" in text
    for topic in ("/setpoints", *MODELS):
        assert f"| `{topic}` |" in text
