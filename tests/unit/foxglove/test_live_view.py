"""`axisync foxglove` between a cell that answers over real Zenoh and a viewer that connects over a real WebSocket."""

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("foxglove", reason="the extra foxglove is not installed")

from axisync_schemas.log_channels import channels, labels
from support.arms import ELBOW_JOINTS, urdf_cell
from support.cell_peer import Peer
from support.daemon import free_port
from support.foxglove_viewer import PATIENCE_S, LiveView, Viewer

TOPICS = {"/setpoints", "/joint_states", "/events", "/log"}
WALL_NS = 1_767_225_600 * 10**9
"""What the peer's `info` has for its wall time, whenever it is asked."""


@pytest.fixture
def peer() -> Iterator[Peer]:
    running = Peer()
    yield running
    running.close()


@pytest.fixture
def view(peer: Peer, tmp_path: Path) -> Iterator[LiveView]:
    with LiveView(tmp_path, peer.endpoint) as running:
        yield running


def test_channels_are_those_of_the_log(peer: Peer, view: LiveView) -> None:
    with Viewer(view.port) as viewer:
        viewer.until(lambda: set(viewer.channels) == TOPICS, "all channels")
        assert viewer.server["name"] == "axisync eod"
        declared = {channel.topic: channel for channel in channels()}
        assert viewer.channels == {topic: declared[topic] for topic in TOPICS}
        assert viewer.metadata["/setpoints"] == labels(peer.cell)


def watched(peer: Peer, viewer: Viewer) -> None:
    """Publishes ticks, in order, until some have come and joint states with them."""
    published = 0

    def publish() -> bool:
        nonlocal published
        peer.publish("setpoints", peer.batch(published + 1, range(10 * published + 1, 10 * published + 11)))
        published += 1
        return viewer.arrived("/setpoints") >= 20 and viewer.arrived("/joint_states") >= 1

    viewer.subscribe("/setpoints", "/joint_states")
    viewer.until(publish, "ticks and joint states")


def test_ticks_come_as_they_were_published(peer: Peer, view: LiveView) -> None:
    with Viewer(view.port) as viewer:
        watched(peer, viewer)
        offset_ns = WALL_NS - round(peer.now_s * 1e9)
        times = [one.log_time_ns for one in viewer.messages("/setpoints", 10)]
        assert set(np.diff(times)) == {2_000_000}
        ticks = viewer.decoded("/setpoints", 10)
        assert [tick.tick for tick in ticks] == list(range(ticks[0].tick, ticks[0].tick + 10))
        assert list(ticks[0].position) == [axis + ticks[0].tick for axis in range(len(peer.cell.axes))]
        assert abs(times[-1] - (ticks[0].tick - 1) * 2_000_000 - offset_ns) < 60e9, (
            "by the daemon's clocks, not by ours"
        )
        (states,) = viewer.decoded("/joint_states", 1)
        assert [joint.name for joint in states.joints] == [axis.name for axis in peer.cell.axes]


def test_an_event_is_a_line_too_where_it_is_a_warning(peer: Peer, view: LiveView) -> None:
    events = [peer.event(1, "as it should be"), peer.event(2, "hot").model_copy(update={"severity": "warning"})]
    with Viewer(view.port) as viewer:
        viewer.subscribe("/events", "/log")

        def publish() -> bool:
            for event in events:
                peer.publish("events", event.model_dump_json())
            return viewer.arrived("/events") >= 2 and viewer.arrived("/log") >= 1

        viewer.until(publish, "events and a line")
        assert {event["message"] for event in viewer.decoded("/events", 2)} == {"as it should be", "hot"}
        (line,) = viewer.decoded("/log", 1)
        assert (line["level"], line["name"]) == (3, "front")
        assert line["message"] == "kind=move_accepted group=kingkong message='hot'"


def test_a_lost_daemon_is_said_and_one_with_another_cell_file_is_taken_up(peer: Peer, view: LiveView) -> None:
    with Viewer(view.port) as viewer:
        watched(peer, viewer)
        peer.close()
        view.said("waiting for it")
        viewer.until(lambda: bool(viewer.statuses), "a status")
        assert "what is shown is old" in viewer.statuses["axisync"]
        peer.cell = urdf_cell("elbow_arm.urdf", ELBOW_JOINTS)
        peer.open()
        view.said("the daemon is back")
        viewer.until(lambda: not viewer.statuses and set(viewer.channels) == TOPICS, "the other cell's channels")
        assert viewer.metadata["/setpoints"] == labels(peer.cell)
        watched(peer, viewer)
        assert len(viewer.decoded("/joint_states", 1)[0].joints) == len(ELBOW_JOINTS)


def test_robot_descriptions_can_be_read_and_not_written(peer: Peer, tmp_path: Path) -> None:
    peer.cell = urdf_cell("elbow_arm.urdf", ELBOW_JOINTS)
    text = (Path(__file__).parents[2] / "support" / "urdf" / "elbow_arm.urdf").read_text()
    with LiveView(tmp_path, peer.endpoint) as view, Viewer(view.port) as viewer:
        viewer.until(lambda: set(viewer.channels) == TOPICS, "all channels")
        viewer.send(op="getParameters", parameterNames=[], id="all")
        viewer.until(lambda: bool(viewer.parameters), "parameters")
        assert viewer.parameters == {"elbow_arm.urdf": text}
        viewer.parameters.clear()
        viewer.send(op="setParameters", parameters=[{"name": "elbow_arm.urdf", "value": "no robot"}], id="set")
        viewer.until(lambda: bool(viewer.parameters), "the answer")
        assert viewer.parameters == {"elbow_arm.urdf": text}


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_it_ends_cleanly_while_somebody_looks(peer: Peer, view: LiveView, number: int, code: int) -> None:
    with Viewer(view.port) as viewer:
        watched(peer, viewer)
        assert view.end(number) == code
    assert "Traceback" not in view.output, view.output


def test_without_a_daemon_it_says_so(tmp_path: Path) -> None:
    with LiveView(tmp_path, f"tcp/127.0.0.1:{free_port()}") as view:
        assert view.process.wait(PATIENCE_S) == 1
        assert view.output.startswith("nobody listens at tcp/127.0.0.1:")
        assert view.output.count("\n") == 1


def test_a_port_that_is_taken_is_said(peer: Peer, view: LiveView, tmp_path: Path) -> None:
    (tmp_path / "second").mkdir()
    with LiveView(tmp_path / "second", peer.endpoint, view.port) as second:
        assert second.process.wait(PATIENCE_S) == 1
        assert second.output.startswith(f"cannot serve on 127.0.0.1:{view.port} (")
        assert second.output.count("\n") == 1
