"""`axisync foxglove` beside the real service, as Foxglove sees it."""

import signal
from itertools import pairwise
from pathlib import Path

import pytest

pytest.importorskip("foxglove", reason="the extra foxglove is not installed")

from axisync_client import Client, deg
from support.cells import eod_text
from support.daemon import running, unhurried
from support.foxglove_viewer import LiveView, Viewer
from support.logread import read_log

pytestmark = pytest.mark.unhurried

TICKS = 200


def test_a_move_is_seen_live_as_it_is_logged_and_a_daemon_that_comes_back_is_seen_again(tmp_path: Path) -> None:
    cell = unhurried(eod_text())
    with running(tmp_path, cell, drives_apart=True) as daemon, LiveView(tmp_path, daemon.endpoint) as view:
        with Viewer(view.port) as viewer:
            viewer.subscribe("/setpoints", "/joint_states", "/events")
            with Client(daemon.endpoint) as client, client.lease("kingkong") as arm:
                arm.enable()
                arm.move_joint(deg(5, 0, 0, 0, 0, 0), relative=True).result()
            viewer.until(lambda: viewer.arrived("/setpoints") >= TICKS, "ticks")
            arrived = viewer.arrived("/setpoints")
            seen = viewer.messages("/setpoints", arrived)
            assert {"move_started", "move_ended"} <= {
                event["kind"] for event in viewer.decoded("/events", viewer.arrived("/events"))
            }
            assert viewer.decoded("/joint_states", 1)[0].joints[0].name == "kingkong.1"

            daemon.stop()
            view.said("waiting for it")
            viewer.until(lambda: bool(viewer.statuses), "the loss said")
            (path,) = daemon.log_dir.glob("*.mcap")
            daemon.start()
            view.said("the daemon is back")
            viewer.until(lambda: not viewer.statuses, "the loss over")
            viewer.messages("/setpoints", viewer.arrived("/setpoints"))
            ticks = [tick.tick for tick in viewer.decoded("/setpoints", TICKS)]
            assert all(after > before for before, after in pairwise(ticks))
            assert view.end(signal.SIGINT) == 130
        assert "Traceback" not in view.output, view.output
    log = read_log(path)
    logged = {record.tobytes(): wall_ns for record, wall_ns in zip(log.ticks, log.log_times_ns.tolist(), strict=True)}
    apart = [abs(one.log_time_ns - logged[one.payload]) for one in seen]
    assert max(apart) < 1e9, "the wall clock was read twice, at two instants"
