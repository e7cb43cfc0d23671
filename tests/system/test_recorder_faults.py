"""The log's disk fills up in mid-move, and the recorder freezes: clients hear of it, motion does not care."""

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from axisync_client import Client, ErrorCode, Lease, MoveStatus, Refused, Stream, deg
from axisync_schemas.replies import Event
from support import logcheck
from support.daemon import Daemon, running
from support.logread import read_log
from support.recording import small_disk


@pytest.fixture
def on_a_small_disk(tmp_path: Path) -> Iterator[Daemon]:
    """Its logs are on a tmpfs of 32 MB."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(small_disk(tmp_path / "logs", 32))
        except PermissionError as error:
            pytest.skip(str(error))
        yield stack.enter_context(running(tmp_path))


def fill_up(directory: Path) -> Path:
    """A file that takes all the room there is."""
    ballast = directory / "ballast"
    with contextlib.suppress(OSError), ballast.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(65536))
    return ballast


def heard(events: Stream[Event], kind: str) -> Event:
    """The next event of a kind."""
    return next(event for event in events if event.kind == kind)


def move(arm: Lease, degrees: float) -> MoveStatus:
    """Moves the first joint there, and waits."""
    return arm.move_joint(deg(degrees, 0, 0, 0, 0, 0), relative=True).result(60).status


def test_full_disk_then_frozen(on_a_small_disk: Daemon) -> None:
    daemon = on_a_small_disk
    with Client(daemon.endpoint) as client, client.lease("kingkong") as arm, client.events() as events:
        arm.enable()
        moving = arm.move_joint(deg(60, 0, 0, 0, 0, 0), relative=True)
        ballast = fill_up(daemon.log_dir)
        alarm = heard(events, "recorder_failing")
        assert (alarm.source, alarm.severity) == ("recorder", "error")
        assert alarm.details["reason"] == "No space left on device"
        assert client.state().recorder.state == "failing"
        assert moving.result(60).status is MoveStatus.SUCCEEDED
        with pytest.raises(Refused) as refused:
            move(arm, -5)
        assert refused.value.code is ErrorCode.UNAVAILABLE
        ballast.unlink()
        heard(events, "recorder_recovered")
        assert move(arm, -5) is MoveStatus.SUCCEEDED

        recorder = daemon.pid("recorder")
        os.kill(recorder, signal.SIGSTOP)
        alarm = heard(events, "recorder_failing")
        assert (alarm.source, alarm.details["reason"]) == ("front", "silent")
        assert move(arm, 5) is MoveStatus.SUCCEEDED
        os.kill(recorder, signal.SIGCONT)
        heard(events, "recorder_recovered")
        recorded = client.state().recorder
    assert daemon.stop() == 0
    assert recorded.lost_ticks == 0
    log = read_log(*sorted(daemon.log_dir.glob("*.mcap")))
    assert logcheck.problems(log) == []
    assert [logcheck.completed(log, one) for one in logcheck.moves(log)] == [True, True, True]
    assert any("the recorder has not been heard of" in line.data["message"] for line in log.lines)
