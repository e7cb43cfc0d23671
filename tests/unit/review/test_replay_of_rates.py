"""Replays of moves that were held, resumed, slowed and stopped, and of what nobody can replay."""

import random
from pathlib import Path

import pytest

from axisync_review import chunks, pieces
from axisync_review.findings import gather
from axisync_review.replay import replay
from axisync_review.review import review_of
from axisync_schemas.enumerations import GroupState
from support.decided_log import Decided
from support.saved_log import event


def same(path: Path, plans: int) -> None:
    found = replay([path])
    assert found.difference is None
    assert (found.plans, found.not_replayed, found.notes) == (plans, 0, ())


def test_hold_resume_override_and_stop(tmp_path: Path) -> None:
    """One move held and resumed, slowed and quickened; one stopped; one of both arms begun at a lower rate."""
    bench = Decided()
    bench.move("kingkong", 1, 0.2)
    bench.run(150)
    bench.ask("hold")
    bench.run(300)
    bench.override(0.5)
    bench.ask("resume")
    bench.run(200)
    bench.override(0.9)
    bench.until_rest()
    bench.move("kingkong", 2, -0.2)
    bench.run(200)
    bench.ask("hold")
    bench.run(20)
    bench.stops[0] += 1
    bench.until_rest()
    bench.override(0.5, "wukong")
    bench.move("both", 3, 0.02)
    bench.run(50, skipped=3)
    bench.override(0.8, "both")
    bench.until_rest()
    path = bench.save(tmp_path)
    same(path, 3)
    found = review_of(gather([path], curves=False))
    assert found.good, found.verdict
    assert [move.status for move in found.moves] == ["succeeded", "stopped", "succeeded"]


@pytest.mark.parametrize("seed", range(2))
def test_whatever_is_asked_at_random(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    bench = Decided()
    for number in (1, 2):
        bench.move("kingkong", number, rng.choice((-0.2, 0.2)) * number)
        for _ in range(rng.randrange(6)):
            bench.run(rng.randrange(1, 150), skipped=rng.choice((0, 0, 2)))
            word = rng.choice(("hold", "resume", "override", "override"))
            bench.override(rng.random()) if word == "override" else bench.ask(word)
        bench.override(1.0)
        bench.ask("resume")
        bench.until_rest()
    path = bench.save(tmp_path)
    same(path, 2)
    found = review_of(gather([path], curves=False))
    assert found.good, found.verdict


def test_an_override_one_tick_later_is_another_motion(tmp_path: Path) -> None:
    bench = Decided()
    bench.move("kingkong", 1, 0.8)
    bench.run(650)
    bench.override(0.5)
    (said,) = [data for _, _, data in bench.told if data.get("kind") == "override_set"]
    tick = said["tick"]
    bench.until_rest()
    said["tick"] += 1
    difference = replay([bench.save(tmp_path)]).difference
    assert difference is not None
    assert difference.tick == tick + 1


def test_a_move_of_one_tick(tmp_path: Path) -> None:
    """It arrives before any tick carries its plan."""
    bench = Decided()
    bench.move("kingkong", 1, 1e-12)
    bench.until_rest()
    same(bench.save(tmp_path), 1)


def test_an_event_that_nobody_can_replay_is_no_difference(tmp_path: Path) -> None:
    bench = Decided()
    bench.move("kingkong", 1, 0.1)
    bench.run(40)
    strange = event("path_blended", bench.tick, plan_id=1)
    bench.override(0.5)
    bench.until_rest()
    bench.told = [said for said in bench.told if said[2].get("kind") != "override_set"]
    found = replay([bench.save(tmp_path, [("/events", strange["tick"], strange)])])
    assert (found.same, found.plans) == (True, 1)
    assert found.not_replayed > 100
    assert "met 'path_blended' at tick" in found.notes[0]


def test_a_jog_at_several_speeds_that_lapses(tmp_path: Path) -> None:
    bench = Decided()
    bench.move("kingkong", 1, 0.5, jog_until_ns=bench.now_ns + 600_000_000)
    bench.run(150)
    for share in (0.5, 0.9, 0.3):
        bench.jog_on("kingkong", 1, share, bench.now_ns + 400_000_000)
        bench.run(100)
    bench.until_rest()
    assert any(record["group_state"][0] == GroupState.JOGGING for record in bench.ticks)
    assert 0.01 < abs(bench.ticks[-1]["position"][0] - bench.ticks[0]["position"][0]) < 0.49
    same(bench.save(tmp_path), 1)


def test_however_the_log_is_cut_for_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rate that falls on after a resume, and the flags of its ticks, go over the cuts."""
    bench = Decided()
    bench.move("kingkong", 1, 0.05)
    bench.run(100)
    bench.ask("hold")
    bench.run(15)
    bench.ask("resume")
    bench.until_rest()
    path, alike = bench.save(tmp_path), chunks._alike
    played, judged = replay([path]), review_of(gather([path], curves=False))
    assert played.same
    assert judged.good, judged.verdict
    assert max(axis.stop_jerk.share for axis in judged.axes) > 0.5
    monkeypatch.setattr(pieces, "PIECE_ROWS", 5)
    monkeypatch.setattr(chunks, "_alike", lambda *run: min(5, alike(*run)))
    assert replay([path]) == played
    again = review_of(gather([path], curves=False))
    assert again.verdict == judged.verdict
    for one, other in zip(again.axes, judged.axes, strict=True):
        assert (one.jerk, one.stop_jerk, one.acceleration) == (other.jerk, other.stop_jerk, other.acceleration)
