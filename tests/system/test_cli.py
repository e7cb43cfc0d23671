"""The `axisync` command and the SDK against the real service, as a user would."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from axisync_client import Client, MoveStatus, deg
from support.cells import eod_text
from support.daemon import Daemon, running, unhurried, wait_for

pytestmark = pytest.mark.unhurried

TIMEOUT_S = 60.0
Axisync = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """One daemon for all tests here; each leaves its group standing still."""
    with running(tmp_path_factory.mktemp("cli"), unhurried(eod_text())) as daemon:
        yield daemon


@pytest.fixture
def axisync(service: Daemon) -> Iterator[Axisync]:
    """Starts a command; kills what a failed test leaves."""
    started: list[subprocess.Popen[str]] = []

    def start(*words: str) -> "subprocess.Popen[str]":
        environment = {**os.environ, "AXISYNC_ENDPOINT": service.endpoint}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        started.append(
            subprocess.Popen([sys.executable, "-m", "axisync_cli", *words], text=True, env=environment, **pipes)
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def outcome(process: "subprocess.Popen[str]") -> tuple[int, str, str]:
    """Exit code, stdout, stderr at its end."""
    out, errors = process.communicate(timeout=TIMEOUT_S)
    return process.returncode, out, errors


def positions(axisync: Axisync, group: str) -> np.ndarray:
    _, out, _ = outcome(axisync("state", "--json"))
    return np.degrees(json.loads(out)["groups"][group]["position"])


def is_moving(client: Client, group: str = "kingkong") -> Callable[[], bool]:
    return lambda: client.state().groups[group].velocity[0] > 0.1


def test_from_disabled_to_arrived(axisync: Axisync) -> None:
    words = ("wukong", "--joint", "10,0,0,0,0,0deg", "--relative")
    assert outcome(axisync("move", *words)) == (1, "", "wukong is disabled: run `axisync enable wukong`\n")
    assert outcome(axisync("enable", "wukong")) == (0, "wukong standstill\n", "")
    before = positions(axisync, "wukong")
    code, out, errors = outcome(axisync("move", *words))
    assert (code, errors) == (0, "")
    assert "limited by wukong.1" in out
    assert out.endswith("wukong arrived\n")
    assert positions(axisync, "wukong") - before == pytest.approx([10, 0, 0, 0, 0, 0], abs=1e-3)
    assert outcome(axisync("disable", "wukong")) == (0, "wukong disabled\n", "")


def test_plan_shows_what_a_move_would_be(axisync: Axisync) -> None:
    target = "--joint=-40,-95,45,-60,-45,45deg"
    code, out, _ = outcome(axisync("plan", "kingkong", target))
    assert code == 0
    assert "kingkong.2" in out
    code, out, _ = outcome(axisync("plan", "kingkong", target, "--json"))
    assert (code, json.loads(out)["limiting"]) == (0, "kingkong.2")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("plan", "kingkong", "--joint", "171,0,0,0,0,0deg"), "kingkong.1: target 171 deg is beyond the soft limit"),
        (("plan", "kingkong", "--joint", "1,2"), "6 axes are expected, not 2"),
        (("plan", "kong", "--joint", "1"), "the groups are kingkong, wukong, both, all"),
        (("stop", "--user", "bob"), "the only user is 'anonymous'"),
        (("state", "--cell", "lab"), "is axisyncd running?"),
    ],
)
def test_refusals_are_one_sentence(axisync: Axisync, words: tuple[str, ...], sentence: str) -> None:
    code, out, errors = outcome(axisync(*words))
    assert (code, out) == (1, "")
    assert sentence in errors
    assert errors.count("\n") == 1


@pytest.mark.parametrize("interrupts", [1, 2])
def test_ctrl_c_stops_the_move(service: Daemon, axisync: Axisync, interrupts: int) -> None:
    assert outcome(axisync("enable", "kingkong"))[0] == 0
    with Client(service.endpoint) as client:
        before = client.state().groups["kingkong"].setpoint[0]
        process = axisync("move", "kingkong", "--joint", "60,0,0,0,0,0deg", "--relative")
        wait_for(is_moving(client), "the arm moves", 30)
        for _ in range(interrupts):
            process.send_signal(signal.SIGINT)
            time.sleep(0.1)
        code, _, errors = outcome(process)
        assert code == 130
        assert "Traceback" not in errors
        wait_for(lambda: client.state().groups["kingkong"].state in ("standstill", "held"), "it stands", 30)
        travelled = client.state().groups["kingkong"].setpoint[0] - before
        assert 0.0 < travelled < np.radians(59)
        client.stop()
        wait_for(lambda: client.state().groups["kingkong"].state == "standstill", "it stands", 30)


def test_a_stop_from_elsewhere_ends_the_command(service: Daemon, axisync: Axisync) -> None:
    assert outcome(axisync("enable", "kingkong"))[0] == 0
    with Client(service.endpoint) as client:
        process = axisync("move", "kingkong", "--joint", "-60,0,0,0,0,0deg", "--relative")
        wait_for(lambda: client.state().groups["kingkong"].velocity[0] < -0.1, "the arm moves", 30)
        client.stop("kingkong")  # a second command may take longer to start than the move takes
    code, _, errors = outcome(process)
    assert code == 1
    assert errors.startswith("kingkong was stopped at ")


def test_an_override_takes_a_move_over_and_sees_it_to_its_end(service: Daemon, axisync: Axisync) -> None:
    assert outcome(axisync("enable", "kingkong"))[0] == 0
    with Client(service.endpoint) as client:
        before = client.state().groups["kingkong"].setpoint[0]
        first = axisync("move", "kingkong", "--joint=-60,0,0,0,0,0deg", "--relative", "--speed", "30%")
        wait_for(lambda: client.state().groups["kingkong"].velocity[0] < -0.01, "the arm moves", 30)
        refused = outcome(axisync("override", "90%", "kingkong"))
        assert refused[0] == 1
        assert "--take takes over" in refused[2]
        code, out, errors = outcome(axisync("override", "90%", "kingkong", "--take"))
        assert (code, errors) == (0, "")
        assert out == "kingkong moving\nkingkong standstill\n"
        assert client.state().groups["kingkong"].setpoint[0] - before == pytest.approx(deg(-60)[0], abs=1e-9)
        code, _, errors = outcome(first)
        assert (code, "the lease on kingkong is lost" in errors) == (1, True)
        assert outcome(axisync("override", "100%", "kingkong")) == (0, "kingkong standstill\n", "")


def test_a_killed_command_leaves_the_move_held(service: Daemon, axisync: Axisync) -> None:
    assert outcome(axisync("enable", "kingkong"))[0] == 0
    with Client(service.endpoint) as client:
        process = axisync("move", "kingkong", "--joint", "60,0,0,0,0,0deg", "--relative", "--speed", "50%")
        wait_for(is_moving(client), "the arm moves", 30)
        process.kill()
        wait_for(lambda: client.state().groups["kingkong"].state == "held", "the lease lapses", 30)
        assert "held" in outcome(axisync("state"))[1]
        assert outcome(axisync("stop"))[0] == 0
        wait_for(lambda: client.state().groups["kingkong"].state == "standstill", "the move is ended", 30)


def seen(client: Client, lines: select.poll) -> bool:
    """Makes an event, and looks whether the command has printed one."""
    with client.lease("wukong"):
        return bool(lines.poll(200))


def test_events_tell_of_a_move(service: Daemon, axisync: Axisync) -> None:
    process = axisync("events", "--follow", "--last", "0", "--json")
    with Client(service.endpoint) as client, client.events() as events:
        lines = select.poll()
        lines.register(process.stdout, select.POLLIN)
        wait_for(lambda: seen(client, lines), "the command's own subscription", TIMEOUT_S)
        with client.lease("kingkong") as arm:
            arm.enable()
            arm.move_joint(deg(-1, 0, 0, 0, 0, 0), relative=True).result(TIMEOUT_S)
        kinds = []
        for event in events:
            kinds.append(event.kind)
            if event.kind == "lease_released" and "move_ended" in kinds:
                break
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    code, out, _ = outcome(process)
    assert code == 130
    printed = [json.loads(line)["kind"] for line in out.splitlines()]
    for kind in ("lease_acquired", "move_accepted", "move_ended", "lease_released"):
        assert kind in kinds
        assert kind in printed


def test_the_newest_events_are_remembered(axisync: Axisync) -> None:
    assert outcome(axisync("enable", "wukong"))[0] == 0
    code, out, _ = outcome(axisync("events", "--last", "200"))
    assert code == 0
    assert "wukong lease_acquired: " in out or "lease_acquired: wukong" in out


def test_setpoints_of_a_move(service: Daemon) -> None:
    with Client(service.endpoint) as client, client.lease("kingkong") as arm, client.setpoints() as setpoints:
        arm.enable()
        columns = next(setpoints).columns("kingkong", client.config())
        move = arm.move_joint(deg(5, 0, 0, 0, 0, 0), relative=True)
        batches = []
        end = time.monotonic() + TIMEOUT_S
        while move.report().status is MoveStatus.EXECUTING:
            batches.append(next(setpoints))
            assert time.monotonic() < end
        batches += [next(setpoints) for _ in range(20)]
    position = np.concatenate([batch.position for batch in batches])[:, columns]
    assert position[-1] - position[0] == pytest.approx(deg(5, 0, 0, 0, 0, 0), abs=1e-9)
    if setpoints.missed == 0:
        ticks = np.concatenate([batch.tick for batch in batches])
        assert (np.diff(ticks.astype(np.int64)) == 1).all()
