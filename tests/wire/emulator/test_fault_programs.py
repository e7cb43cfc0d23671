"""Faults of the program itself: by a script, and at run time through its control socket and `inject`."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisync_emulator.faults.command import app as injection
from axisync_emulator.faults.control import ask
from axisync_emulator.simcan.interface import SimCanBus

CELL_FILE = Path(__file__).parents[3] / "service/axisync_service/cells/eod.toml"
MASTER = Path(__file__).parent / "lock_step_master.py"
SCRIPT = """
seed = 3
[[faults]]
kind = "lose"
bus = "kingkong"
id = 0x201
probability = 0.05

[[faults]]
kind = "corrupt"
bus = "wukong"
probability = 0.02

[[faults]]
kind = "drift"
bus = "wukong"
node = 2
ppm = 500

[[faults]]
kind = "emergency"
bus = "kingkong"
node = 5
code = 0x2310
at_sync = 100
"""


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "axisync_emulator.main", *map(str, arguments)]


class Program:
    """The emulator in a process of its own."""

    def __init__(self, directory: Path, *arguments: object) -> None:
        directory.mkdir(exist_ok=True)
        self.process = subprocess.Popen(
            command(CELL_FILE, "--simcan", directory, "--statistics", *arguments),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def end(self) -> str:
        """What it wrote to stderr."""
        self.process.terminate()
        return self.process.communicate(timeout=10)[1]


@pytest.fixture
def control(tmp_path: Path) -> Path:
    return tmp_path / "control.sock"


@pytest.fixture
def running(tmp_path: Path, control: Path) -> Iterator[Program]:
    program = Program(tmp_path, "--bus", "kingkong", "--control", control)
    yield program
    program.end()


def dump_of(directory: Path, *arguments: object) -> str:
    """One scripted move over both buses in lock-step, as the buses saw it."""
    program = Program(directory, "--lock-step", "--candump", directory / "dump.log", *arguments)
    try:
        subprocess.run([sys.executable, str(MASTER), str(directory)], check=True, timeout=60)
    finally:
        program.end()
    return (directory / "dump.log").read_text()


def test_a_script_of_faults_gives_the_same_frames_each_time(tmp_path: Path):
    script = tmp_path / "faults.toml"
    script.write_text(SCRIPT)
    first = dump_of(tmp_path / "a", "--faults", script)
    assert first == dump_of(tmp_path / "b", "--faults", script)
    assert 180 <= first.count(" kingkong 201#") < 200  # of 200
    assert first.count(" kingkong 206#") >= 199
    assert first.count(" kingkong 085#102303") == 1


def refused(*arguments: object) -> tuple[int, str]:
    done = subprocess.run(command(CELL_FILE, *arguments), capture_output=True, text=True, timeout=60)
    return done.returncode, done.stderr


def test_a_wrong_script_is_refused(tmp_path: Path):
    script = tmp_path / "faults.toml"
    script.write_text(SCRIPT.replace("node = 5", "node = 55"))
    status, errors = refused("--simcan", tmp_path, "--faults", script)
    assert (status, errors) == (2, "axisync-emulator: node 55 is none of 1, 2, 3, 4, 5, 6 on bus kingkong\n")
    script.write_text(SCRIPT.replace('"lose"', '"loose"'))
    status, errors = refused("--simcan", tmp_path, "--faults", script)
    assert status == 2
    assert errors.startswith(f"axisync-emulator: {script}: faults.0: ")
    assert list(tmp_path.glob("*.sock")) == []


def inject(*arguments: object) -> tuple[int, str, str]:
    """The command, in this process."""
    done = CliRunner().invoke(injection, [*map(str, arguments)])
    return done.exit_code, done.stdout, done.stderr


def heard(bus: SimCanBus, seconds: float) -> list[tuple[int, str]]:
    time.sleep(seconds)
    return [(can_id, data.hex()) for can_id, data, _ in bus.drain()]


def test_faults_at_run_time(running: Program, tmp_path: Path, control: Path):
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    assert ask(control, {"inject": {"kind": "mute", "bus": "kingkong", "node": 3}}) == {"fault": 1}
    bus.drain()
    assert 0x703 not in dict(heard(bus, 0.3))
    assert ask(control, {"cancel": 1}) == {"fault": 1}
    assert 0x703 in dict(heard(bus, 0.3))
    assert ask(control, {"inject": {"kind": "reset", "bus": "kingkong", "node": 9}}) == {
        "error": "node 9 is none of 1, 2, 3, 4, 5, 6 on bus kingkong"
    }
    for nonsense in ({"cancel": 9}, {"explode": 9}, {"inject": 3}, {"list": False}):
        assert "error" in ask(control, nonsense)
    bus.shutdown()
    assert "fault=1 stage=over bus=kingkong node=3 kind=mute" in running.end()
    assert not control.exists()


def test_inject_is_a_command_of_the_emulator(tmp_path: Path):
    done = subprocess.run(command("inject", "--help"), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert "axisync-emulator inject" in done.stdout


def test_a_person_injects(running: Program, tmp_path: Path, control: Path):
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    assert inject(control, "kind=emergency", "bus=kingkong", "node=2", "code=0x2310") == (0, '{"fault": 1}\n', "")
    assert (0x082, "1023030000000000") in heard(bus, 0.1)
    status, out, _ = inject(control)
    assert (status, [(line["fault"], line["stage"]) for line in map(json.loads, out.splitlines())]) == (
        0, [(1, "active")],
    )  # fmt: skip
    assert inject(control, "--cancel", 1)[0] == 0
    status, out, errors = inject(control, "kind=melt", "bus=kingkong")
    assert (status, out) == (1, "")
    assert errors.startswith("axisync-emulator inject: ")
    assert inject(control, "kind")[0] == 2
    bus.shutdown()
    assert inject(tmp_path / "none.sock", "kind=reset") == (
        1, "", f"axisync-emulator inject: {tmp_path}/none.sock: No such file or directory\n",
    )  # fmt: skip


def test_faults_at_run_time_in_lock_step(tmp_path: Path, control: Path):
    program = Program(tmp_path, "--bus", "kingkong", "--lock-step", "--control", control)
    bus = SimCanBus(str(tmp_path / "kingkong.sock"))
    source = bus.time_source
    assert source is not None
    now = source.wait_until_ns(source.now_ns() + 150_000_000)
    bus.drain()
    assert ask(control, {"inject": {"kind": "reset", "bus": "kingkong", "node": 4}}) == {"fault": 1}
    source.wait_until_ns(now + 1_000_000)
    ((can_id, data, at),) = bus.drain()
    assert (can_id, data) == (0x704, b"\x00")
    assert now < at < now + 100_000
    bus.shutdown()
    program.end()
