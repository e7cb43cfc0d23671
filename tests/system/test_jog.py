"""Jogs on the real service: by the SDK, by the command line, by clients that die; judged from the log."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisync_client import Client, Lease, Refused, deg
from axisync_schemas.enumerations import GroupState
from axisync_schemas.internal import JOG_LAPSED, JOG_RELEASED
from support import logcheck
from support.daemon import Daemon, running, wait_for
from support.logread import Log, logs_in, read_log

TTL_S = 1.0
"""A machine that other work shares may be silent for longer than a key that is held."""
PATIENCE_S = 60.0
LATE_S = 0.2
"""Of the controller, where the machine pauses just then."""


def setpoint(client: Client, group: str = "kingkong") -> np.ndarray:
    return np.array(client.state().groups[group].setpoint)


def state(client: Client, group: str = "kingkong") -> str:
    return client.state().groups[group].state


def until_it_moves(client: Client, axis: int, by: float) -> None:
    begin = setpoint(client)[axis]
    wait_for(lambda: (setpoint(client)[axis] - begin) * np.sign(by) > abs(by), f"axis {axis} by {by}", PATIENCE_S)


def by_the_sdk(client: Client, lease: Lease) -> None:
    with lease.jog("kingkong", velocity=deg(8, 0, 0, 0, 0, 0), ttl_s=TTL_S) as motion:
        assert motion.reply is not None
        assert motion.reply.state == "moving"
        until_it_moves(client, 0, 0.05)
        motion.velocity = deg(3, 0, 0, 0, 0, 0)
        until_it_moves(client, 0, 0.02)
        motion.velocity = deg(0, 0, 0, 0, 0, -20)
        until_it_moves(client, 5, -0.1)
    assert state(client) == "standstill"
    with lease.jog("kingkong", space="body", velocity=(0, 0, -0.03), ttl_s=TTL_S):
        until_it_moves(client, 0, 0.02)
    assert state(client) == "standstill"


def against_a_limit(client: Client, lease: Lease) -> None:
    with lease.jog("kingkong", velocity=deg(0, -30, 0, 0, 0, 0), ttl_s=TTL_S) as motion:
        wait_for(lambda: motion.blocked is not None, "the soft limit", PATIENCE_S)
        assert motion.blocked is not None
        assert motion.blocked.code == "SOFT_LIMIT"
        assert motion.blocked.details["axis"] == "kingkong.2"
        assert setpoint(client)[1] == pytest.approx(np.radians(-200), abs=1e-12)
        motion.velocity = deg(0, 30, 0, 0, 0, 0)
        until_it_moves(client, 1, 0.1)


def stopped_by_somebody(client: Client, lease: Lease) -> None:
    def held() -> None:
        with lease.jog("kingkong", velocity=deg(0, 0, -10, 0, 0, 0), ttl_s=TTL_S) as motion:
            until_it_moves(client, 2, -0.05)
            client.stop("kingkong")
            motion.sleep(PATIENCE_S)

    with pytest.raises(Refused, match="let go of the jog"):
        held()
    wait_for(lambda: state(client) == "standstill", "at rest", PATIENCE_S)
    time.sleep(1.0)  # let go


def killed_client(daemon: Daemon, client: Client) -> None:
    """Its lease outlives it for two seconds, its jog only for 0.2."""
    words = ("-m", "axisync_cli", "jog", "wukong", "--joint", "0,10deg,0,0,0,0")
    environment = {**os.environ, "AXISYNC_ENDPOINT": daemon.endpoint}
    with subprocess.Popen([sys.executable, *words], env=environment, stdout=subprocess.PIPE) as process:
        wait_for(lambda: state(client, "wukong") == "jogging", "it moves", PATIENCE_S)
        process.kill()
    wait_for(lambda: state(client, "wukong") == "standstill", "at rest", PATIENCE_S)


def interrupted_command(daemon: Daemon, client: Client) -> tuple[int, str]:
    words = ("-m", "axisync_cli", "jog", "wukong", "--joint", "0,10deg,0,0,0,0")
    environment = {**os.environ, "AXISYNC_ENDPOINT": daemon.endpoint}
    with subprocess.Popen([sys.executable, *words], env=environment, stderr=subprocess.PIPE, text=True) as process:
        wait_for(lambda: state(client, "wukong") == "jogging", "it moves", PATIENCE_S)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE_S)
    return process.returncode, errors


@pytest.fixture(scope="module")
def jogged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Log]:
    """Everything above on one daemon, and the log that it leaves."""
    directory: Path = tmp_path_factory.mktemp("jog")
    with running(directory) as daemon:
        with Client(daemon.endpoint) as client:
            with client.lease("both", ttl_s=10.0) as lease:
                lease.enable("both")
                by_the_sdk(client, lease)
                against_a_limit(client, lease)
                stopped_by_somebody(client, lease)
            killed_client(daemon, client)
            time.sleep(2.5)  # until its lease has lapsed
            code, errors = interrupted_command(daemon, client)
            assert (code, "interrupted" in errors) == (130, True), errors
        assert daemon.stop() == 0, daemon.output
        yield read_log(*logs_in(daemon.log_dir))


def test_limits_hold_at_every_tick(jogged: Log) -> None:
    """By differences of positions: that of velocity and position within a tick is no bound on ways of the tool."""
    checks = (
        logcheck.tick_problems,
        logcheck.time_problems,
        logcheck.limit_problems,
        logcheck.count_problems,
        logcheck.rest_problems,
        logcheck.move_problems,
    )
    assert [problem for check in checks for problem in check(jogged)] == []
    states = jogged.ticks["group_state"]
    for group in range(2):
        assert (states[:, group] == GroupState.JOGGING).any()
    assert not (states == GroupState.HELD).any()


def test_jogs_end_as_they_were_ended(jogged: Log) -> None:
    reasons = [details["reason"] for details, _ in events(jogged, "move_ended")]
    assert "stop" in reasons
    assert JOG_RELEASED in reasons
    assert JOG_LAPSED in reasons
    assert None in reasons, "the way's end, at the soft limit"


def test_a_killed_client_moves_nothing_after_the_time_its_last_request_gave(jogged: Log) -> None:
    tick = [tick for details, tick in events(jogged, "move_stopping") if details["reason"] == JOG_LAPSED][-1]
    (row,) = np.flatnonzero(jogged.ticks["tick"] == tick)
    stopping_s = float(jogged.ticks["cycle_start_ns"][row]) * 1e-9
    jogs = [one.data for one in jogged.requests if one.data["verb"] == "jog" and one.data.get("error") is None]
    last = max((jog for jog in jogs if jog["received_s"] < stopping_s), key=lambda jog: float(jog["received_s"]))
    assert last["body"]["group"] == "wukong"
    assert stopping_s - last["received_s"] < last["body"]["ttl_s"] + LATE_S


def test_what_replay_needs_is_there(jogged: Log) -> None:
    """Every jog is a plan with its coefficients; every change of its rate and its end has a tick of effect."""
    started = {details["plan_id"] for details, _ in events(jogged, "move_started")}
    assert started
    assert started <= set(jogged.plans)
    assert {plan["move"]["kind"] for plan in jogged.plans.values()} == {"jog"}
    assert all(plan["coefficients"] for plan in jogged.plans.values())
    assert events(jogged, "jog_speed")
    for kind in ("move_started", "jog_speed", "move_stopping", "move_ended"):
        assert all(tick for _, tick in events(jogged, kind))


def events(log: Log, kind: str) -> list[tuple[dict[str, Any], int | None]]:
    """Details and tick of each."""
    return [(event.data["details"], event.data["tick"]) for event in log.events if event.data["kind"] == kind]
