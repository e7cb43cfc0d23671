"""The paper's move, end to end on simcan: by a client of its own process, judged from frames and log."""

import math
import subprocess
import sys

import numpy as np
import pytest

from support import framecheck, logcheck
from support.daemon import Daemon, running
from support.logread import read_log

P1 = (0, -150, 60, -45, -45, 45)
P2 = (100, -90, -60, -120, 45, 45)


def axisync(daemon: Daemon, *arguments: str) -> str:
    """Runs the command line as a user would; its output."""
    done = subprocess.run(
        [sys.executable, "-m", "axisync_cli.main", *arguments],
        env={**daemon.environment, "AXISYNC_ENDPOINT": daemon.endpoint},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def degrees(values: tuple[float, ...]) -> str:
    return ",".join(map(str, values)) + "deg"


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Daemon:
    """P1 -> P2, then both arms at once, on one daemon that was ended properly."""
    with running(tmp_path_factory.mktemp("move")) as daemon:
        axisync(daemon, "enable", "all")
        axisync(daemon, "move", "kingkong", "--joint", degrees(P2))
        axisync(daemon, "move", "both", "--relative", "--joint", degrees((-10,) * 6 + (5,) * 6))
        daemon.code = daemon.stop()  # type: ignore[attr-defined]
    return daemon


def test_it_ended_cleanly(played: Daemon) -> None:
    assert played.code == 0  # type: ignore[attr-defined]
    assert "Traceback" not in played.output


def test_the_plan_takes_the_papers_time(played: Daemon) -> None:
    log = read_log(*sorted(played.log_dir.glob("*.mcap")))
    plan = log.plans[min(log.plans)]
    assert plan["reply"]["limiting"] == "kingkong.3"
    # The drives start on whole counts, up to 3e-6 rad from P1.
    assert plan["reply"]["duration_s"] == pytest.approx(5.25, abs=1e-4)


def test_the_log_keeps_every_promise(played: Daemon) -> None:
    log = read_log(*sorted(played.log_dir.glob("*.mcap")))
    assert logcheck.problems(log) == []
    assert [logcheck.completed(log, move) for move in logcheck.moves(log)] == [True, True]


def test_it_stands_on_the_target_to_the_bit(played: Daemon) -> None:
    log = read_log(*sorted(played.log_dir.glob("*.mcap")))
    target = np.array([math.radians(x) for x in P2])
    positions = log.ticks["position"][:, :6]
    assert (positions == target).all(axis=1).any()


def test_frames_carry_what_the_log_says(played: Daemon) -> None:
    log = read_log(*sorted(played.log_dir.glob("*.mcap")))
    frames = [frame for path in sorted(played.frames_dir.glob("*.log")) for frame in framecheck.parse(path)]
    assert len(frames) > 1000
    assert framecheck.problems(log, framecheck.collect(log.cell, frames, first_tick=1)) == []


def test_drives_arrived_as_well(played: Daemon) -> None:
    log = read_log(*sorted(played.log_dir.glob("*.mcap")))
    standing = np.flatnonzero(log.ticks["group_state"][:, 0] == 1)
    last = log.ticks[standing[-1]]
    error = np.abs(last["position_actual"] - last["position"])
    assert error.max() < 2 * 2 * math.pi / 1048576
