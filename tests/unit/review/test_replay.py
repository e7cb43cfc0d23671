"""A replay gives the same bits as a good log, and finds the first bit that is not."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisync_review import chunks, pieces
from axisync_review.replan import replan_all
from axisync_review.replay import Replay, replay
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import Records
from support.command_line import Run
from support.saved_log import STOP_TICK, Maker, event

TICK = 700


@pytest.mark.parametrize("stop_tick", [None, 1, 2, 400, STOP_TICK])
def test_every_setpoint_again(make: Maker, stop_tick: int | None) -> None:
    found = replay([make.write(stop_tick)])
    assert found.difference is None
    assert (found.same, found.plans, found.notes) == (True, 1, ())
    assert found.ticks > 40


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "jerk"])
@pytest.mark.parametrize("stop_tick", [None, 400])
def test_one_bit_is_found(make: Maker, name: str, stop_tick: int | None) -> None:
    row = {None: TICK, 400: 450}[stop_tick]

    def edit(ticks: Records) -> None:
        ticks[name][row, 3] = np.nextafter(ticks[name][row, 3], np.inf)

    difference = replay([make.write(stop_tick, edit)]).difference
    assert difference is not None
    assert (difference.tick, difference.what) == (row + 1, f"kingkong.4: {name}")
    assert difference.logged != difference.replayed


@pytest.mark.parametrize(("name", "axis"), [("target_counts", 2), ("path_s", 0), ("path_rate", 0)])
def test_one_count_and_the_path_clock_are_compared(make: Maker, name: str, axis: int) -> None:
    def edit(ticks: Records) -> None:
        ticks[name][TICK, axis] += 1

    difference = replay([make.write(edit=edit)]).difference
    assert difference is not None
    assert difference.tick == TICK + 1
    assert difference.what.endswith(name)


def test_a_setpoint_that_moves_at_rest(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["position"][5, 8] = np.nextafter(ticks["position"][5, 8], 9.0)

    difference = replay([make.write(edit=edit)]).difference
    assert difference is not None
    assert (difference.tick, difference.what) == (6, "wukong.3: position")


def test_what_is_disabled_follows_its_actual_position(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["group_state"][:, 1] = GroupState.DISABLED
        ticks["position_actual"][:, 6:] += 1e-5 * np.sin(ticks["tick"])[:, np.newaxis]
        ticks["position"][1:, 6:] = ticks["position_actual"][:-1, 6:]
        scale = 1048576 / (2.0 * np.pi)
        ticks["target_counts"][:, 6:] = np.rint(ticks["position"][:, 6:] * scale)

    assert replay([make.write(edit=edit)]).same


def test_a_stop_one_tick_later_is_another_motion(make: Maker) -> None:
    path = make.write(STOP_TICK, story=False, more=_story(STOP_TICK, later=1))
    difference = replay([path]).difference
    assert difference is not None
    assert difference.tick == 20 + STOP_TICK + 1


def _story(stop_tick: int, later: int) -> list[tuple[str, int, dict[str, Any]]]:
    from support.saved_log import DISTANCE, session, story_of

    told = story_of(session(stop_tick), stop_tick, "kingkong", DISTANCE)
    for _, _, message in told:
        if message.get("kind") == "move_stopping":
            message["tick"] += later
    return told


@pytest.mark.parametrize(("rows", "stop_tick"), [(1, 2), (3, 2), (90, STOP_TICK)])
def test_pieces_do_not_show(make: Maker, monkeypatch: pytest.MonkeyPatch, rows: int, stop_tick: int) -> None:
    log, alike = make.write(stop_tick), chunks._alike
    whole = replay([log])
    monkeypatch.setattr(pieces, "PIECE_ROWS", rows)
    monkeypatch.setattr(chunks, "_alike", lambda *run: min(rows, alike(*run)))
    assert replay([log]) == whole
    assert whole.same


def test_a_move_that_began_before_the_log(make: Maker) -> None:
    """The second of two files: the plan is there, and the path parameter tells how long it has run."""
    plan = [told for told in _story(STOP_TICK, later=0) if told[0] == "/plans"]
    path = make.write(span=slice(TICK, None), story=False, more=plan)
    found = replay([path])
    assert (found.same, found.plans, found.notes) == (True, 1, ())


def test_without_its_plan_nothing_is_claimed(make: Maker) -> None:
    found = replay([make.write(story=False)])
    assert (found.same, found.plans) == (True, 0)
    assert found.notes[0] == "plan 1 is not in the log: its setpoints were not compared"


def test_a_plan_without_its_tables(make: Maker) -> None:
    """As an older service logged it."""
    told = _story(STOP_TICK, later=0)
    for topic, _, message in told:
        if topic == "/plans":
            message["rate_codes"] = ""
    found = replay([make.write(story=False, more=told)])
    assert (found.same, found.plans) == (True, 0)
    assert found.notes[0].startswith("plan 1 cannot be read (the path clock's tables cannot be read")


@pytest.mark.parametrize("rates", [{"1": "fast"}, {"1": 2.0}, {"1": None}])
def test_an_override_that_is_none(make: Maker, rates: dict[str, object]) -> None:
    strange = event("override_set", TICK, rates=rates)
    found = replay([make.write(more=[("/events", TICK, strange)])])
    assert (found.same, found.plans) == (True, 1)
    assert f"met 'override_set' at tick {TICK}" in found.notes[0]


def test_ticks_that_are_missing_do_not_stop_a_replay(make: Maker) -> None:
    found = replay([make.write(edit=lambda ticks: np.delete(ticks, slice(600, 610)))])
    assert found.same, found.difference
    assert found.notes == ("10 ticks are missing in the log and could not be compared",)


def test_planning_again(good_log: Path) -> None:
    (plan,) = replan_all([good_log])
    assert (plan.same, plan.move_id, plan.reason) == (True, "m-1", None)
    assert plan.error is not None
    assert plan.error <= 1e-12


def test_planning_something_else(make: Maker) -> None:
    """The request says another target than the plan that was played."""
    told = _story(STOP_TICK, later=0)
    for topic, _, message in told:
        if topic == "/plans":
            target = message["move"]["target"]
            message["move"] = {**message["move"], "target": [target[0] + 1e-6, *target[1:]]}
    (plan,) = replan_all([make.write(story=False, more=told)])
    assert not plan.same
    assert plan.error == pytest.approx(1e-6, rel=1e-3)


def test_a_request_that_cannot_be_planned(make: Maker) -> None:
    told = _story(STOP_TICK, later=0)
    for topic, _, message in told:
        if topic == "/plans":
            message["move"] = {"kind": "teleport"}
    (plan,) = replan_all([make.write(story=False, more=told)])
    assert not plan.same
    assert plan.reason


def test_the_command(run: Run, good_log: Path, make: Maker) -> None:
    shown = run("replay", good_log, "--replan")
    assert (shown.code, shown.err) == (0, "")
    assert "m-1 of kingkong: planned again, at most 0 rad away" in shown.out
    assert "the same to the bit: " in shown.out
    printed = run("replay", good_log, "--json").json
    assert printed.pop("replanned") == []
    assert Replay.model_validate({**printed, "notes": tuple(printed["notes"])}).same


def test_the_command_fails_on_a_difference(run: Run, make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["position"][TICK, 0] += 1e-12

    shown = run("replay", make.write(edit=edit))
    assert shown.code == 1
    assert f"DIFFERENT from tick {TICK + 1} on: kingkong.1: position is" in shown.out
