"""Ctrl-C, with the command as a process of its own."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from axisync_schemas.enumerations import MoveStatus
from support.cell_peer import Peer
from support.command_line import Run

MOVE = ("move", "kingkong", "--joint", "5,0,0,0,0,0deg", "--relative", "--duration", "60")
Command = Callable[..., "subprocess.Popen[str]"]
INTERRUPTED_WHILE_LOADING = """
import os, signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
from axisync_cli.entry import main
sys.exit(main())
"""


@pytest.fixture
def command(peer: Peer) -> Iterator[Command]:
    started: list[subprocess.Popen[str]] = []

    def start(*words: str) -> "subprocess.Popen[str]":
        started.append(
            subprocess.Popen(
                [sys.executable, "-m", "axisync_cli", *words, "--endpoint", peer.endpoint],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONUNBUFFERED": "1"},
            )
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def wait_until(what: Callable[[], object]) -> None:
    end = time.monotonic() + 20.0
    while not what():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize("module", ["axisync_cli.main", "typer", "zenoh"])
def test_ctrl_c_before_the_command_is_loaded_just_ends_it(module: str) -> None:
    command = [sys.executable, "-c", INTERRUPTED_WHILE_LOADING, module, "state"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_ctrl_c_stops_the_move_and_waits(peer: Peer, command: Command) -> None:
    peer.states["kingkong"] = "standstill"
    process = command(*MOVE)
    wait_until(lambda: peer.moves)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert peer.moves["m-1"].ended is MoveStatus.STOPPED
    assert "stopping kingkong" in errors
    assert errors.endswith("kingkong standstill\n")
    assert not peer.leases


def test_ctrl_c_stops_a_program(peer: Peer, command: Command, tmp_path: Path) -> None:
    peer.states["kingkong"] = "standstill"
    program = tmp_path / "wait.toml"
    step = '[[steps]]\nkind = "dwell"\nduration_s = 60\n'
    program.write_text('schema = 1\nname = "wait"\ngroup = "kingkong"\n' + step * 60)
    process = command("run", str(program))
    wait_until(lambda: peer.moves)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert (process.returncode, peer.moves["m-1"].ended) == (130, MoveStatus.STOPPED)
    assert errors.endswith("kingkong standstill\n")
    assert not peer.leases


def test_ctrl_c_before_the_answer_stops_as_well(peer: Peer, command: Command) -> None:
    peer.deaf["move"] = 99
    process = command(*MOVE, "--timeout", "60")
    wait_until(lambda: any(verb == "move" for verb, _, _ in peer.requests))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    assert process.returncode == 130
    assert [body["group"] for verb, _, body in peer.requests if verb == "stop"] == ["kingkong"]


def test_a_second_ctrl_c_leaves_at_once(peer: Peer, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    peer.states["kingkong"] = "standstill"
    monkeypatch.setattr(peer, "label", lambda name: "stopping")  # for ever
    process = command(*MOVE)
    wait_until(lambda: peer.moves)
    process.send_signal(signal.SIGINT)
    wait_until(lambda: any(verb == "stop" for verb, _, _ in peer.requests))
    time.sleep(0.3)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=5)
    assert process.returncode == 130


def test_a_lease_is_held_until_ctrl_c(peer: Peer, command: Command) -> None:
    process = command("lease", "kingkong")
    assert process.stdout is not None
    assert process.stdout.readline().startswith("anonymous holds kingkong until Ctrl-C")
    assert peer.leases
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 130
    assert not peer.leases


def test_a_lease_that_is_taken_ends_the_command(peer: Peer, command: Command) -> None:
    first = command("lease", "kingkong")
    assert first.stdout is not None
    first.stdout.readline()
    second = command("lease", "kingkong", "--take", "--json")
    assert second.stdout is not None
    assert '"kingkong": "anonymous"' in second.stdout.readline()
    _, errors = first.communicate(timeout=20)
    assert (first.returncode, errors.count("\n")) == (1, 1)
    assert "the lease on kingkong is lost" in errors
    second.send_signal(signal.SIGINT)
    assert second.wait(timeout=20) == 130


def test_events_are_printed_until_ctrl_c(peer: Peer, command: Command) -> None:
    process = command("events", "--follow")
    assert process.stdout is not None
    line: list[str] = []
    end = time.monotonic() + 20.0
    os.set_blocking(process.stdout.fileno(), False)
    while not line:
        assert time.monotonic() < end
        peer.publish("events", peer.event(1, "hello").model_dump_json())
        time.sleep(0.05)
        line = [text for text in [process.stdout.readline()] if text]
    assert line == ["12:00:00 front kingkong move_accepted: hello\n"]
    process.send_signal(signal.SIGINT)
    process.wait(timeout=20)
    assert process.returncode == 130


def test_watch_in_json_and_a_closed_pipe(peer: Peer, command: Command) -> None:
    process = command("watch", "--json")
    assert process.stdout is not None
    end = time.monotonic() + 20.0
    os.set_blocking(process.stdout.fileno(), False)
    while not process.stdout.readline():
        assert time.monotonic() < end
        peer.publish("state", peer.state(1).model_dump_json())
        time.sleep(0.05)
    process.stdout.close()
    while process.poll() is None:
        assert time.monotonic() < end
        peer.publish("state", peer.state(1).model_dump_json())
        time.sleep(0.05)
    assert process.stderr is not None
    assert process.stderr.read() == ""


def test_a_jog_that_is_over_says_where_it_ended(run: Run, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not that it was still stopping then."""
    labels = iter(["stopping"] * 3)
    monkeypatch.setattr(peer, "label", lambda name: next(labels, "standstill"))
    shown = run("jog", "kingkong", "--joint", "0,0,5deg,0,0,0", "--for", "100ms")
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.splitlines()[-1] == "kingkong standstill"
