"""Each process is killed once in mid-move. What should follow is judged from outside: log, state, and the drives."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress

import numpy as np
import pytest

from axisync_client import AxisyncError, Client, Lease, Move, MoveStatus, Refused, Unavailable, deg
from axisync_schemas.enumerations import GroupState
from support import logcheck
from support.daemon import Daemon, wait_for
from support.logread import read_log

FAR = deg(120, 0, 0, 0, 0, 0)


@contextmanager
def moving(daemon: Daemon, *, loses: bool = False) -> Iterator[tuple[Client, Lease, Move]]:
    """KingKong in mid-move, under a lease, which the block `loses` where the test takes the service away from it."""
    stack = ExitStack()
    try:
        client = stack.enter_context(Client(daemon.endpoint))
        arm = stack.enter_context(client.lease("kingkong"))
        arm.enable()
        move = arm.move_joint(FAR, relative=True)
        wait_for(lambda: client.state().groups["kingkong"].velocity[0] > 0.2, "the arm moves", 10)
        yield client, arm, move
    finally:
        with suppress(AxisyncError) if loses else nullcontext():
            stack.close()


def state_of(client: Client, group: str = "kingkong") -> str | None:
    """The group's state, None while nobody answers."""
    try:
        return client.state().groups[group].state
    except AxisyncError:
        return None


def connected(daemon: Daemon) -> Client:
    """To a front that may still be starting again."""
    end = time.monotonic() + 30.0
    while True:
        try:
            return Client(daemon.endpoint)
        except Unavailable:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


def enable_and_move(daemon: Daemon) -> None:
    """The service is whole again."""
    with Client(daemon.endpoint) as client, client.lease("kingkong") as arm:
        _patiently(arm.enable)  # its drives may still be on their way up
        report = arm.move_joint(deg(-5, 0, 0, 0, 0, 0), relative=True).result(20)
        assert report.status is MoveStatus.SUCCEEDED


def test_front_killed_the_move_is_held_and_adopted(daemon: Daemon) -> None:
    with moving(daemon, loses=True) as (_, arm, move):
        os.kill(daemon.pid("front"), signal.SIGKILL)
        wait_for(lambda: arm.lost, "the lease is lost loudly", 15)
    with connected(daemon) as client:
        wait_for(lambda: state_of(client) == "held", "the new front shows the held move", 15)
        report = client.move_report(move.reply.move_id or "")
        assert report.status is MoveStatus.HELD
        assert 0.0 < report.progress < 1.0
        time.sleep(0.5)
        assert state_of(client) == "held", "nothing resumes by itself"
        client.stop("kingkong")
        wait_for(lambda: state_of(client) == "standstill", "stop ends the held move", 5)
    enable_and_move(daemon)
    assert daemon.stop() == 0
    assert logcheck.problems(read_log(*sorted(daemon.log_dir.glob("*.mcap")))) == []


def test_planner_killed_nothing_moves_differently(daemon: Daemon) -> None:
    with moving(daemon) as (_, arm, move):
        os.kill(daemon.pid("planner"), signal.SIGKILL)
        assert move.result(30).status is MoveStatus.SUCCEEDED
        wait_for(lambda: len(daemon.pids("planner")) == 1, "the planner is back", 10)
        assert _patiently(lambda: arm.move_joint(deg(-5, 0, 0, 0, 0, 0), relative=True)).result(20)
    assert daemon.stop() == 0
    assert logcheck.problems(read_log(*sorted(daemon.log_dir.glob("*.mcap")))) == []


def test_recorder_killed_nothing_is_lost(daemon: Daemon) -> None:
    with moving(daemon) as (_, _, move):
        os.kill(daemon.pid("recorder"), signal.SIGKILL)
        assert move.result(30).status is MoveStatus.SUCCEEDED
    assert daemon.stop() == 0
    files = sorted(daemon.log_dir.glob("*.mcap"))
    assert len(files) == 2
    log = read_log(*files)
    assert logcheck.problems(log) == []
    assert [logcheck.completed(log, move) for move in logcheck.moves(log)] == [True]


def test_controller_killed_the_drives_stop_by_themselves(daemon: Daemon) -> None:
    with moving(daemon, loses=True) as (client, arm, move):
        before = client.state().groups["kingkong"].position[0]
        os.kill(daemon.pid("controller"), signal.SIGKILL)
        wait_for(lambda: state_of(client) == "disabled" and client.state().controller == "up", "it is back", 20)
        wait_for(lambda: all(d.state == "switch_on_disabled" for d in client.state().groups["kingkong"].drives),
                 "the drives are off", 10)  # fmt: skip
        stopped = client.state().groups["kingkong"].position[0]
        # 30 deg/s through 51 missed cycles of 2 ms, then down at 90 deg/s^2, and what was still to be read before.
        assert 0.0 < np.degrees(stopped - before) < 30 * (0.15 + 0.1) + 30**2 / (2 * 90) + 1
        assert move.report().status is MoveStatus.FAILED
        with pytest.raises(Refused):
            arm.move_joint(FAR, relative=True)  # not enabled
    enable_and_move(daemon)
    assert daemon.stop() == 0
    log = read_log(*sorted(daemon.log_dir.glob("*.mcap")))
    assert any("0x8700" in str(event.data["details"]) for event in log.events), "the drives' error history is logged"


def test_frozen_front_cannot_keep_a_lease_alive(daemon: Daemon) -> None:
    with moving(daemon, loses=True):
        front = daemon.pid("front")
        os.kill(front, signal.SIGSTOP)
        time.sleep(3.5)  # the lease lapses after 2 s; the cycle compares it every tick
        os.kill(front, signal.SIGCONT)
    with Client(daemon.endpoint) as client:
        assert client.state().groups["kingkong"].state == "held"
    assert daemon.stop() == 0
    log = read_log(*sorted(daemon.log_dir.glob("*.mcap")))
    assert logcheck.problems(log) == []
    slowing = [event.data for event in log.events if event.data["kind"] == "move_stopping"]
    assert [event["details"]["reason"] for event in slowing] == ["lease lapsed"]


def test_frozen_controller_is_restarted_disabled(daemon: Daemon) -> None:
    with moving(daemon, loses=True) as (client, _, _):
        before = daemon.pid("controller")
        os.kill(before, signal.SIGSTOP)
        wait_for(lambda: daemon.pids("controller") not in ([], [before]), "the watchdog replaces it", 10)
        wait_for(lambda: state_of(client) == "disabled" and client.state().controller == "up", "it is back", 20)
    enable_and_move(daemon)


def test_supervisor_killed_everything_stops_and_ends(daemon: Daemon) -> None:
    assert daemon.process is not None
    with moving(daemon, loses=True) as (client, _, _):
        daemon.process.kill()
        daemon.process.wait()
        wait_for(lambda: not daemon.pids(), "every process has ended", 15)
        with pytest.raises(Unavailable):
            client.state()
    log = read_log(*sorted(daemon.log_dir.glob("*.mcap")))
    assert log.complete
    assert log.ticks["group_state"][-1].tolist() == [GroupState.DISABLED, GroupState.DISABLED]
    assert logcheck.problems(log) == []


def test_emulator_killed_is_a_fault_of_its_group(daemon: Daemon) -> None:
    with moving(daemon) as (client, _, move):
        for pid in daemon.pids("emulator"):
            os.kill(pid, signal.SIGKILL)
        wait_for(lambda: state_of(client) == "fault", "the group is in fault", 10)
        assert move.wait(10).status is MoveStatus.FAILED


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_clean_stop_in_mid_move_leaves_nothing_behind(daemon: Daemon, number: int) -> None:
    with moving(daemon, loses=True) as (client, _, _):
        assert daemon.stop(number) == 0
        with pytest.raises(Unavailable):
            client.state()
    assert daemon.pids() == []
    assert "Traceback" not in daemon.output
    left = [path for path in daemon.runtime_directory.rglob("*") if not path.is_dir() and path.suffix != ".lock"]
    assert left == []
    log = read_log(*sorted(daemon.log_dir.glob("*.mcap")))
    assert log.complete
    assert log.ticks["group_state"][-1].tolist() == [GroupState.DISABLED, GroupState.DISABLED]
    assert logcheck.problems(log) == []
    daemon.start()  # the locks are free again


def test_second_daemon_refuses_to_start(daemon: Daemon) -> None:
    second = subprocess.run(
        daemon.command, env=daemon.environment, capture_output=True, text=True, timeout=30, check=False
    )
    assert second.returncode == 1
    assert "cell eod is already served by process" in second.stderr
    assert "Traceback" not in second.stderr


def test_log_directory_that_cannot_be_written_is_refused(daemon: Daemon) -> None:
    assert daemon.stop() == 0
    blocked = daemon.directory / "file"
    blocked.write_text("in the way")
    run = [blocked if argument == str(daemon.log_dir) else argument for argument in daemon.command]
    done = subprocess.run(run, env=daemon.environment, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 1
    assert "cannot write a log into" in done.stderr
    assert "Traceback" not in done.stderr


def _patiently(attempt, seconds: float = 5.0):  # type: ignore[no-untyped-def]
    """Tries until it is not refused any longer."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            return attempt()
        except AxisyncError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)
