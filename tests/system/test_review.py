"""Logs of the real service: its moves, a stop and a refusal are reviewed, explained and played again."""

import json
import subprocess
import sys
import time
from pathlib import Path

from mcap.reader import SeekingReader

from axisync_client import Client, MoveStopped, Refused
from axisync_review.models import Review
from support.daemon import Daemon
from support.logread import logs_in


def axisync(*words: str | Path) -> "subprocess.CompletedProcess[str]":
    """The command line, as a process."""
    command = [sys.executable, "-m", "axisync_cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def play(daemon: Daemon) -> None:
    """A move that is held, resumed and slowed and arrives, one that is stopped, one that is refused."""
    with Client(daemon.endpoint) as client:
        with client.lease("kingkong") as arm:
            arm.enable()
            first = arm.move_joint([0.4, 0, 0, 0, 0, 0], relative=True)
            time.sleep(0.5)
            arm.hold()
            arm.override(0.6)
            arm.resume()
            time.sleep(0.5)
            arm.override(1.0)
            first.result()
            move = arm.move_joint([0.8, 0, 0, 0, 0, 0], relative=True)
            time.sleep(0.6)
            arm.stop()
            try:
                move.result()
            except MoveStopped:
                pass
            else:
                raise AssertionError("the move was not stopped")
        with client.lease("wukong") as other:
            try:
                other.move_joint([0.1, 0, 0, 0, 0, 0], relative=True)
            except Refused:
                return
        raise AssertionError("a disabled arm was moved")


def test_a_real_log(daemon: Daemon, tmp_path: Path) -> None:
    play(daemon)
    assert daemon.stop() == 0
    (log,) = logs_in(daemon.log_dir)

    report = tmp_path / "report.html"
    shown = axisync("review", log, "--html", report, "--json")
    review = Review.model_validate_json(shown.stdout)
    assert (shown.returncode, review.good, shown.stderr) == (0, True, ""), review.verdict
    assert [move.status for move in review.moves] == ["succeeded", "stopped"]
    assert [incident.kind for incident in review.incidents] == ["stop", "stop", "refusal"]
    assert review.axes[0].stop_jerk.peak > 0.0
    assert 0.0 < review.axes[0].following_error_share < 1.0
    assert report.read_text("utf-8").startswith("<!doctype html>")

    replayed = axisync("replay", log, "--replan")
    assert replayed.returncode == 0, replayed.stdout
    assert "the same to the bit" in replayed.stdout
    assert replayed.stdout.count("planned again") == 2

    why = json.loads(axisync("why", log, "--json").stdout)[1:]
    texts = [fact["text"] for fact in why[0]["evidence"]]
    assert "anonymous sent stop" in texts
    assert any("at rest after" in text for text in texts)
    assert "wukong" in why[1]["message"]

    with log.open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert sum(1 for _ in reader.iter_messages()) == summary.statistics.message_count
