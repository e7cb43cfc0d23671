"""The paper's move and tool change on the kernel's CAN: the real service, emulated drives on vcan0 and vcan1, a client.

At a slower period, since user-mode Linux has one CPU. Judged from frames and log, as on simcan.
"""

import contextlib
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from axisync_client import Client, deg
from axisync_emulator.faults.control import ask
from axisync_schemas.cell import override
from axisync_schemas.replies import MoveReply
from axisync_service.demo import PROGRAMS
from support import framecheck, logcheck
from support.cells import eod_text
from support.daemon import Daemon, patient, running, wait_for
from support.logread import Log, read_log
from support.tool_path import off_corners, off_lines
from vcan.slower_cell import slower

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(400)]

P2 = (100, -90, -60, -120, 45, 45)
PERIOD_MS = 40.0
TICKS_LATE: dict[str, float | int] = {"missed_ticks_max": 12, "tpdo_missed_max": 25}
OVER_CURRENT = 0x2310
STEP = (0.4, 0.0, 0.0, 0.0, 0.0, 0.0)
"""WuKong's, rad."""
BUFFER_BYTES = 8 << 20
"""For an observer that does not get the CPU for seconds."""


@dataclass(slots=True)
class Played:
    """One run that was ended properly; `seen`: what `candump` of can-utils recorded, where it is installed."""

    daemon: Daemon
    code: int
    log: Log
    seen: list[Path]


def axisync(daemon: Daemon, *arguments: str) -> str:
    """Runs the command line as a user would; its output."""
    done = subprocess.run(
        [sys.executable, "-m", "axisync_cli.main", "--timeout", "20", *arguments],
        env={**daemon.environment, "AXISYNC_ENDPOINT": daemon.endpoint},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr + daemon.output
    return done.stdout


def change_tool(daemon: Daemon) -> None:
    """KingKong: P1 to P2, then its tool change. Planning takes seconds here, in which others do not get the CPU."""
    with Client(daemon.endpoint, timeout_s=20.0) as client, client.lease("kingkong", ttl_s=10.0) as lease:
        lease.move_joint(deg(*P2)).result()
        lease.run_program(PROGRAMS / "tool_change.toml", speed_scale=0.5).result()


def shapeless(text: str) -> str:
    """The cell with arms that cannot touch anything: the longer the period, the further drives left alone go, which
    would be too far for this move."""
    return re.sub(r"(?m)^radius_m = .*$", "", text)


def fail_in_mid_move(daemon: Daemon, control: Path) -> None:
    """WuKong moves until its third drive reports an error."""
    with Client(daemon.endpoint, timeout_s=20.0) as client, client.lease("wukong", ttl_s=10.0) as lease:
        move = lease.move_joint(STEP, relative=True, speed_scale=0.2)
        wait_for(lambda: client.state().groups["wukong"].state == "moving", "a move of wukong", 30.0)
        fault = {"kind": "emergency", "bus": "wukong", "node": 3, "code": OVER_CURRENT}
        assert "fault" in ask(control, {"inject": fault})
        assert move.wait().status == "failed"
        wait_for(lambda: client.state().groups["wukong"].state == "fault", "fault of wukong", 30.0)


@contextlib.contextmanager
def recorded(directory: Path) -> Iterator[list[Path]]:
    """An observer on each bus that is none of our code; no files where there is no candump."""
    channels = ("vcan0", "vcan1") if shutil.which("candump") else ()
    files = [directory / f"{channel}.log" for channel in channels]
    with contextlib.ExitStack() as stack:
        for channel, file in zip(channels, files, strict=True):
            output = stack.enter_context(file.open("wb"))
            process = stack.enter_context(
                subprocess.Popen(["candump", "-r", str(BUFFER_BYTES), "-L", channel], stdout=output)
            )
            stack.callback(process.terminate)
        yield files


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """KingKong: P1 to P2, its tool change. WuKong: an error of its third drive in mid-move, reset, a move again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AXISYNC_MOTION_BACKEND", "python")  # nothing to compile, which takes a minute there
        yield play(tmp_path_factory.mktemp("vcan"))


def play(directory: Path) -> Played:
    """All of it, from the start of the service to its end."""
    text = slower(override(patient(shapeless(eod_text())), TICKS_LATE), PERIOD_MS)
    with recorded(directory) as seen, running(directory, text, ("--control", str(directory))) as daemon:
        axisync(daemon, "enable", "all")
        change_tool(daemon)
        fail_in_mid_move(daemon, directory / "wukong.sock")
        axisync(daemon, "reset", "wukong")
        axisync(daemon, "enable", "wukong")
        axisync(daemon, "move", "wukong", "--joint", "-2,0,0,0,0,0deg", "--relative")
        code = daemon.stop()
    return Played(daemon, code, read_log(*sorted(daemon.log_dir.glob("*.mcap"))), seen)


def test_it_ran_on_the_kernels_buses_and_ended_cleanly(played: Played) -> None:
    assert "vcan0, vcan1 of this kernel" in played.daemon.output
    assert "Traceback" not in played.daemon.output
    assert played.code == 0


def test_the_plan_takes_the_papers_time(played: Played) -> None:
    plan, *_ = played.log.plans.values()
    # The drives start on whole counts, up to 3e-6 rad from P1.
    assert plan["reply"]["duration_s"] == pytest.approx(5.25, abs=1e-4)


def test_the_log_keeps_every_promise(played: Played) -> None:
    assert logcheck.problems(played.log) == []
    assert [logcheck.completed(played.log, move) for move in logcheck.moves(played.log)] == [True, True, False, True]


def test_an_error_of_a_drive_stops_its_arm_and_reset_leads_on(played: Played) -> None:
    events = [event.data for event in played.log.events]
    told = [event for event in events if event["kind"] == "emergency"]
    assert [event["details"]["error_code"] for event in told] == [OVER_CURRENT]
    assert "wukong.3: EMCY 0x2310" in told[0]["message"]
    words = [event["details"]["after"] for event in events
             if event["kind"] == "group_state" and event["group"] == "wukong"]  # fmt: skip
    assert words[:-1] == ["standstill", "moving", "stopping", "fault", "disabled", "standstill", "moving", "standstill"]


def frame_problems(played: Played, files: list[Path]) -> list[str]:
    """What does not agree with the log."""
    frames = [frame for file in files for frame in framecheck.parse(file)]
    return framecheck.problems(played.log, framecheck.collect(played.log.cell, frames, first_tick=1))


def test_the_drives_received_what_the_log_says(played: Played) -> None:
    files = sorted(played.daemon.frames_dir.glob("*.log"))
    assert len(files) == 2
    assert frame_problems(played, files) == []


def test_candump_saw_what_the_log_says(played: Played) -> None:
    if not played.seen:
        pytest.skip("there is no candump (Debian: apt install can-utils)")
    assert frame_problems(played, played.seen) == []


def test_the_drives_arrived(played: Played) -> None:
    first, second, *_ = played.log.plans
    plan_id = played.log.ticks["plan_id"][:, 0]
    standing = np.flatnonzero(played.log.ticks["group_state"][:, 0] == 1)
    begun, next_begun = np.flatnonzero(plan_id == first)[0], np.flatnonzero(plan_id == second)[0]
    last = played.log.ticks[standing[(standing > begun) & (standing < next_begun)][-1]]
    target = np.array([math.radians(x) for x in P2])
    assert (last["position"][:6] == target).all()
    assert np.abs(last["position_actual"][:6] - target).max() < 2 * 2 * math.pi / 1048576


def test_the_tool_changes_its_tool(played: Played) -> None:
    _, plan, *_ = played.log.plans.values()
    reply = MoveReply.model_validate_json(json.dumps(plan["reply"]))
    distance, turn = off_corners(played.log, reply)
    assert distance < 1e-4
    assert turn < 1e-3
    assert off_lines(played.log, reply, samples=25) < 1e-5
