"""/joint_states and /log as viewers read them: by the schemas in the file alone."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from axisync_schemas.log_channels import channels
from axisync_service.recorder.recorder import SECOND_NS
from support.recorder_here import START_NS, Bench

WALL_S = 1_700_000_000


def read(path: Path, topic: str) -> list[tuple[int, Any]]:
    """Log time and message of all of a topic."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        if topic == "/joint_states":
            return [(message.log_time, decoded) for _, _, message, decoded in reader.iter_decoded_messages([topic])]
        return [(message.log_time, json.loads(message.data)) for _, _, message in reader.iter_messages([topic])]


def closed(bench: Bench) -> Path:
    bench.recorder.close()
    (path,) = bench.directory.glob("*.mcap")
    return path


def test_joint_states_are_measured_positions_and_rates_at_50_hz(bench: Bench) -> None:
    bench.run(1, 300)
    states = read(closed(bench), "/joint_states")
    assert len(states) == 30
    names = [axis.name for axis in bench.cell.axes]
    for number, (log_time, state) in enumerate(states, start=1):
        tick = 10 * number
        due_ns = START_NS + tick * 2_000_000 + WALL_S * SECOND_NS
        assert (log_time, state.timestamp.seconds * SECOND_NS + state.timestamp.nanos) == (due_ns, due_ns)
        assert [joint.name for joint in state.joints] == names
        fed = bench.feeder.record(tick)["position_actual"].copy()
        assert [joint.position for joint in state.joints] == fed.astype(np.float32).tolist()
        assert not any(joint.HasField("effort") for joint in state.joints)
        if number == 1:
            assert not any(joint.HasField("velocity") for joint in state.joints)
        else:
            before = bench.feeder.record(tick - 10)["position_actual"]
            assert np.allclose([joint.velocity for joint in state.joints], (fed - before) / 0.02, rtol=1e-6)


def test_a_gap_has_no_velocity_over_it(bench: Bench) -> None:
    bench.run(1, 20)
    bench.feeder.write(36, 50)
    bench.step()
    states = [state for _, state in read(closed(bench), "/joint_states")]
    assert [state.joints[0].HasField("velocity") for state in states] == [False, True, False, True]


def test_warnings_and_errors_that_come_as_events_are_lines(bench: Bench) -> None:
    bench.event("realtime", "warning")
    bench.event("group_state")
    bench.event("drive_lost", "error", source="controller")
    bench.step()
    lines = read(closed(bench), "/log")
    assert [(line["level"], line["name"]) for _, line in lines] == [(3, "controller"), (4, "controller")]
    assert lines[1][1]["message"] == "kind=drive_lost message='drive_lost of the test'"
    log_time, line = lines[0]
    assert line["timestamp"]["sec"] * SECOND_NS + line["timestamp"]["nsec"] == log_time


def test_a_storm_of_errors_is_twenty_lines_a_second(bench: Bench) -> None:
    for second in range(2):
        for _ in range(50):
            bench.event("drive_lost", "error")
        bench.step(1.0 if second == 0 else 0.0)
    lines = [line["message"] for _, line in read(closed(bench), "/log")]
    assert len(lines) == 40
    assert lines[20].endswith("left_out=30")


@pytest.mark.parametrize("channel", channels(), ids=lambda channel: channel.topic)
def test_no_schema_refers_to_a_definition_elsewhere(channel: Any) -> None:
    assert channel.schema
    if channel.schema_encoding == "jsonschema":
        assert b"$ref" not in channel.schema
        assert json.loads(channel.schema)["type"] == "object"


def test_the_schemas_of_foxglove_have_its_names_and_fields() -> None:
    by_topic = {channel.topic: channel for channel in channels()}
    assert by_topic["/joint_states"].name == "foxglove.JointStates"
    line = by_topic["/log"]
    assert line.name == "foxglove.Log"
    fields = json.loads(line.schema)["properties"]
    assert set(fields) == {"timestamp", "level", "message", "name", "file", "line"}
    assert set(fields["timestamp"]["properties"]) == {"sec", "nsec"}
