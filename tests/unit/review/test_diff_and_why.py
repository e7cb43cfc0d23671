"""Two runs side by side; and what led to a stop, a fault or a refusal."""

from pathlib import Path

import numpy as np

from axisync_review.diff import Diff, diff
from axisync_review.findings import gather
from axisync_review.why import WhyReview, why
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import Records
from support.command_line import Run
from support.saved_log import REST_TICKS, STOP_TICK, Maker, at_tick, event


def test_a_run_is_the_same_as_itself(good_log: Path, make: Maker) -> None:
    """Later, with other lateness and other drives: the same program."""

    def edit(ticks: Records) -> None:
        ticks["lateness_ns"] *= 2
        ticks["position_actual"] += 1e-4

    found = diff([good_log], [make.write(edit=edit)])
    assert found.same
    assert found.summary.startswith("the same program: 1 moves")
    assert found.timing.p99_b > 1.8 * found.timing.p99_a
    assert found.axes[0].peak_b > found.axes[0].peak_a


def test_a_move_that_was_stopped_differs(good_log: Path, stopped_log: Path) -> None:
    found = diff([good_log], [stopped_log])
    (move,) = found.moves
    assert (found.same, move.same_plan, move.same_setpoints) == (False, True, False)
    assert (move.status_a, move.status_b, move.plan_error) == ("succeeded", "stopped", 0.0)
    assert found.summary == "1 of 1 moves differ; the first is move 1 of kingkong"


def test_another_program_differs(good_log: Path, make: Maker) -> None:
    found = diff([good_log], [make.write(distance=-0.9)])
    (move,) = found.moves
    assert (found.same, move.same_plan, move.same_setpoints) == (False, False, False)
    assert move.plan_error is not None
    assert abs(move.plan_error - 0.1) < 0.05
    nothing = diff([good_log], [make.write(span=slice(0, 10), story=False)])
    assert nothing.moves[0].move_b is None


def test_the_command_diff(run: Run, good_log: Path, stopped_log: Path) -> None:
    assert run("diff", good_log, stopped_log).code == 1
    shown = run("diff", good_log, stopped_log, "--json")
    assert Diff.model_validate_json(shown.out).moves[0].status_b == "stopped"


def test_why_a_move_was_stopped(stopped_log: Path) -> None:
    (found,) = why(gather([stopped_log]))
    assert found.message == "kingkong was brought to rest on its path: stop"
    assert found.tick == REST_TICKS + STOP_TICK
    texts = [fact.text for fact in found.evidence]
    assert texts[0].startswith("ann asked for a joint move of kingkong")
    assert "bob sent stop" in texts
    assert any(text.startswith("at rest after 0.") and "of its path: standstill" in text for text in texts)
    slowed = next(fact for fact in found.evidence if "slows from this tick on" in fact.text)
    assert slowed.tick == REST_TICKS + STOP_TICK + 1
    assert [fact.t_s for fact in found.evidence] == sorted(fact.t_s for fact in found.evidence)


def test_why_a_lease_lapsed(make: Maker) -> None:
    """The event of front, the last renewal, and the stop, in this order."""
    tick = REST_TICKS + STOP_TICK
    lapsed = event("lease_lapsed", tick - 2, "kingkong: lease of ann lapsed") | {"source": "front", "tick": None}
    renewal = {
        "request_id": "r-3", "user": "ann", "verb": "lease", "body": {"action": "renew", "groups": ["kingkong"]},
        "received_s": at_tick(3) / 1e9, "answered_s": at_tick(3) / 1e9, "reply": {},
    }  # fmt: skip
    stopping = event("move_stopping", tick, "slows: lease lapsed", plan_id=1, reason="lease lapsed")
    path = make.write(
        STOP_TICK, more=[("/events", tick - 2, lapsed), ("/requests", 3, renewal), ("/events", tick, stopping)]
    )
    found = next(one for one in why(gather([path])) if "lease lapsed" in one.message)
    sources = [(fact.source, fact.text.split(":")[0]) for fact in found.evidence]
    assert ("front", "lease_lapsed") in sources
    assert any("earlier: renew of ann" in fact.text for fact in found.evidence)


def test_why_a_drive_failed(make: Maker) -> None:
    """Six drives that say the same are one line."""

    def edit(ticks: Records) -> None:
        ticks["statusword"][300:, :6] = 0x0208
        ticks["group_state"][302:, 0] = GroupState.FAULT

    faults = [
        ("/events", 300, event("emergency", 300, f"kingkong.{n}: EMCY 0x8700, SYNC lost") | {"severity": "error"})
        for n in range(1, 7)
    ]
    state = event("group_state", 301, "kingkong: moving -> fault", before="moving", after="fault", reason="SYNC lost")
    path = make.write(edit=edit, story=False, more=[*faults, ("/events", 301, state)])
    (found,) = why(gather([path]))
    texts = [fact.text for fact in found.evidence]
    assert found.message == "kingkong is in fault: SYNC lost"
    assert sum("EMCY 0x8700" in text for text in texts) == 1
    assert any("kingkong.1, kingkong.2" in text and "operation enabled -> fault" in text for text in texts)


def test_why_a_request_was_refused(make: Maker, run: Run) -> None:
    error = {"code": "NOT_ENABLED", "message": "wukong is disabled",
             "details": {"group": "wukong", "position": [0.123456789, -1.0], "time_s": 2 / 3}}  # fmt: skip
    request = {
        "request_id": "r-9", "user": "eve", "verb": "move", "body": {"group": "wukong"},
        "received_s": at_tick(99) / 1e9, "answered_s": at_tick(100) / 1e9, "error": error,
    }  # fmt: skip
    path = make.write(more=[("/requests", 100, request)])
    shown = run("why", path)
    assert (shown.code, shown.err) == (0, "")
    assert "move of eve was refused: NOT_ENABLED: wukong is disabled" in shown.out
    assert "refused after 2.0 ms: group=wukong, position=[0.123457, -1], time_s=0.666667\n" in shown.out
    (found,) = run("why", path, "--json").json
    found["evidence"] = tuple(found["evidence"])
    assert WhyReview.model_validate(found).kind == "refusal"


def test_nothing_to_explain(run: Run, good_log: Path) -> None:
    assert run("why", good_log).out == "nothing was stopped, nothing was refused, no tick is missing\n"
    assert run("why", good_log, "--json").json == []


def test_a_compound_is_one_move(make: Maker) -> None:
    found = diff([make.write(group="both")], [make.write(group="both")])
    assert found.same
    assert [move.group for move in found.moves] == ["both"]
    assert np.isfinite([axis.rms_a for axis in found.axes]).all()
