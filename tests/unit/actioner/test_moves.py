"""The life of a move, in the actioner."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from axisync_schemas.enumerations import GroupState, MoveStatus, Phase
from axisync_schemas.errors import ErrorBody, ErrorCode, Refusal
from axisync_schemas.internal import BeginCommand, ControllerEvent, ControllerReply, PlanResult
from axisync_schemas.replies import Event
from axisync_service.actioner.moves import Move, Moves
from axisync_service.actioner.planner_queue import TIMEOUT_NS
from axisync_service.actioner.ports import Answer

Read = Callable[[list[Answer]], dict[str, Any]]


def ended(plan_id: int, status: str, reason: str | None = None) -> ControllerEvent:
    details = {"plan_id": plan_id, "status": status, "reason": reason}
    return ControllerEvent(
        event=Event(source="controller", kind="move_ended", now_s=0, wall_time="", message="", tick=1, details=details)
    )


def begun(rig: Any) -> tuple[list[Answer], BeginCommand]:
    """A move that the controller has been told to begin."""
    lease = rig.lease("both")
    answers = rig.move("kingkong", lease)
    rig.plan(rig.ports.jobs[-1])
    return answers, rig.ports.commands[-1]


def accepted(rig: Any) -> tuple[str, BeginCommand]:
    answers, command = begun(rig)
    rig.actioner.on_controller(ControllerReply(ref=command.ref, tick=1), rig.observe())
    rig.show(0, state=GroupState.MOVING, plan_id=command.plan_id, slot=command.slot, path_s=0.5)
    assert not answers[0].is_error
    return f"m-{command.plan_id}", command


def status(rig: Any, move_id: str) -> MoveStatus:
    return MoveStatus(rig.actioner.find_move(move_id, rig.world.now_ns).status)


def test_a_move_is_planned_begun_and_accepted(rig: Any, ok: Read) -> None:
    answers, command = begun(rig)
    job = rig.ports.jobs[0]
    assert job.start == rig.world.setpoint[:6]
    assert (command.plan_id, command.slot) == (job.plan_id, job.slot) == (1000, 0)
    assert command.epochs == (8,)
    assert command.stop_counts == (0,)
    assert answers == []
    rig.actioner.on_controller(ControllerReply(ref=command.ref, tick=1), rig.observe())
    reply = ok(answers)
    assert reply["move_id"] == "m-1000"
    assert reply["now_s"] == rig.world.now_s
    assert "move_accepted" in rig.ports.kinds()
    topics = [(topic, slot, plan) for topic, _, slot, plan in rig.ports.logged]
    assert ("/plans", 0, 1000) in topics


def test_nobody_hears_of_a_move_before_it_is_accepted(rig: Any) -> None:
    begun(rig)
    with pytest.raises(Refusal) as caught:
        status(rig, "m-1000")
    assert caught.value.code is ErrorCode.NOT_FOUND


def test_progress_and_success(rig: Any) -> None:
    move_id, command = accepted(rig)
    report = rig.actioner.find_move(move_id, rig.world.now_ns)
    assert (report.status, report.progress) == (MoveStatus.EXECUTING, 0.25)
    rig.actioner.on_controller(ended(command.plan_id, "succeeded"), rig.observe())
    report = rig.actioner.find_move(move_id, rig.world.now_ns)
    assert (report.status, report.progress) == (MoveStatus.SUCCEEDED, 1.0)


def test_held_and_then_stopped(rig: Any) -> None:
    move_id, command = accepted(rig)
    rig.show(0, state=GroupState.HELD, reason="lease lapsed")
    report = rig.actioner.find_move(move_id, rig.world.now_ns)
    assert (report.status, report.reason) == (MoveStatus.HELD, "lease lapsed")
    rig.observe()
    assert rig.ports.kinds().count("move_held") == 1
    rig.actioner.on_controller(ended(command.plan_id, "stopped", "stop"), rig.observe())
    report = rig.actioner.find_move(move_id, rig.world.now_ns)
    assert (report.status, report.reason, report.progress) == (MoveStatus.STOPPED, "stop", 0.25)


def test_the_controller_refuses(rig: Any, no: Read) -> None:
    answers, command = begun(rig)
    error = ErrorBody(code=ErrorCode.WRONG_STATE, message="not so", details={"group": "kingkong"})
    rig.actioner.on_controller(ControllerReply(ref=command.ref, tick=1, error=error), rig.observe())
    found = no(answers)
    assert (found["code"], found["details"]) == ("WRONG_STATE", {"group": "kingkong"})
    rig.move("kingkong", rig.lease_token)
    assert len(rig.ports.jobs) == 2


def test_the_planner_refuses(rig: Any, no: Read) -> None:
    answers = rig.move("kingkong", rig.lease("kingkong"))
    job = rig.ports.jobs[0]
    error = ErrorBody(code=ErrorCode.INFEASIBLE_DURATION, message="too short", details={"shortest_duration_s": 1.0})
    rig.actioner.on_plan(PlanResult(ref=job.ref, error=error), rig.observe())
    assert no(answers)["details"] == {"shortest_duration_s": 1.0}
    assert rig.ports.commands == []


def test_one_plan_at_a_time_for_each_group(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    first, other = rig.move("kingkong", lease), rig.move("wukong", lease)
    assert no(rig.move("kingkong", lease))["code"] == "BUSY"
    assert no(rig.move("both", lease))["code"] == "BUSY"
    assert no(rig.send("plan", group="wukong", move={"target": [0.0] * 6}))["code"] == "BUSY"
    assert first == other == []
    assert len(rig.ports.jobs) == 1, "the planner has one job at a time"
    rig.plan(rig.ports.jobs[0])
    assert [job.group for job in rig.ports.jobs] == ["kingkong", "wukong"]


def test_a_group_that_moves_is_busy_but_the_other_is_not(rig: Any, no: Read) -> None:
    accepted(rig)
    assert no(rig.move("kingkong", rig.lease_token))["code"] == "BUSY"
    assert no(rig.move("both", rig.lease_token))["code"] == "BUSY"
    assert rig.move("wukong", rig.lease_token) == []
    assert rig.ports.jobs[-1].slot == 1


def test_a_move_sent_but_not_yet_answered_keeps_its_group(rig: Any, no: Read) -> None:
    begun(rig)
    assert no(rig.move("kingkong", rig.lease_token))["code"] == "BUSY"


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda rig: rig.ports.stops.__setitem__(0, 1), "WRONG_STATE"),
        (lambda rig: rig.send("lease", action="take", groups=["kingkong"]), "LEASE_REQUIRED"),
        (lambda rig: rig.send("lease", action="take", groups=["both"]), "LEASE_FENCED"),
        (lambda rig: rig.wait(1.0), "LEASE_FENCED"),
        (lambda rig: rig.show(0, state=GroupState.FAULT), "FAULTED"),
        (lambda rig: setattr(rig, "world", replace(rig.world, phase=Phase.STOPPING)), "UNAVAILABLE"),
        (lambda rig: setattr(rig.ports, "controller_there", False), "UNAVAILABLE"),
    ],
)
def test_what_changes_while_planning_counts(rig: Any, no: Read, change: Any, code: str) -> None:
    answers = rig.move("kingkong", rig.lease("both", ttl_s=1.0))
    change(rig)
    assert answers == []
    rig.plan(rig.ports.jobs[0])
    assert no(answers)["code"] == code
    assert rig.ports.commands == []


def test_a_move_that_becomes_stale_while_planning(rig: Any, no: Read) -> None:
    answers = rig.move("kingkong", rig.lease("kingkong"), not_after_s=rig.world.now_s + 1.0)
    rig.world = replace(rig.world, now_ns=rig.world.now_ns + TIMEOUT_NS - 1)
    rig.plan(rig.ports.jobs[0])
    assert no(answers)["code"] == "STALE"


def test_a_planner_that_hangs_is_killed(rig: Any, no: Read) -> None:
    lease = rig.lease("both")
    hangs, waits = rig.move("kingkong", lease), rig.move("wukong", lease)
    rig.wait(TIMEOUT_NS / 1e9)
    assert no(hangs)["code"] == "INTERNAL"
    assert rig.ports.kills == 1
    rig.plan(rig.ports.jobs[0])
    assert waits == [], "a late answer is nobody's"
    rig.plan(rig.ports.jobs[1])
    assert rig.ports.commands[-1].group == "wukong"


def test_a_planner_that_dies(rig: Any, no: Read) -> None:
    answers = rig.move("kingkong", rig.lease("kingkong"))
    rig.actioner.on_planner_down()
    assert no(answers)["code"] == "INTERNAL"


def test_no_planner(rig: Any, no: Read) -> None:
    rig.ports.planner_there = False
    answers = rig.move("kingkong", rig.lease("kingkong"))
    assert answers == []
    rig.wait(TIMEOUT_NS / 1e9)
    assert no(answers)["code"] == "UNAVAILABLE"
    assert rig.ports.kills == 0


def test_plan_moves_nothing_and_needs_no_lease(rig: Any, ok: Read) -> None:
    rig.show(state=GroupState.DISABLED)
    answers = rig.send("plan", group="both", move={"target": [0.0] * 12})
    assert rig.ports.jobs[0].slot is None
    rig.plan(rig.ports.jobs[0])
    reply = ok(answers)
    assert reply["move_id"] is None
    assert rig.ports.commands == []
    with pytest.raises(Refusal):
        status(rig, f"m-{rig.ports.jobs[0].plan_id}")


def test_a_move_of_no_length_succeeds_at_once(rig: Any, ok: Read) -> None:
    answers = rig.move("kingkong", rig.lease("kingkong"))
    rig.plan(rig.ports.jobs[0], duration_s=0.0)
    move_id = ok(answers)["move_id"]
    assert status(rig, move_id) is MoveStatus.SUCCEEDED
    assert rig.ports.commands == []
    assert rig.ports.kinds()[-2:] == ["move_accepted", "move_ended"]
    assert [slot for topic, _, slot, _ in rig.ports.logged if topic == "/plans"] == [None]


def test_the_controller_goes_down_in_mid_move(rig: Any) -> None:
    move_id, _ = accepted(rig)
    rig.world = replace(rig.world, up=False)
    rig.show(state=GroupState.DISABLED, plan_id=0)
    report = rig.actioner.find_move(move_id, rig.world.now_ns)
    assert (report.status, report.reason) == (MoveStatus.FAILED, "the controller went down")


def test_the_controller_goes_down_before_it_answers(rig: Any, no: Read) -> None:
    answers, _ = begun(rig)
    rig.world = replace(rig.world, up=False)
    rig.observe()
    assert no(answers)["code"] == "UNAVAILABLE"


def test_the_controller_does_not_answer(rig: Any, no: Read) -> None:
    answers, _ = begun(rig)
    rig.wait(9.0)
    assert no(answers)["code"] == "UNAVAILABLE"


def test_a_move_whose_end_was_not_heard_of(rig: Any) -> None:
    move_id, _ = accepted(rig)
    rig.show(0, state=GroupState.STANDSTILL, plan_id=0)
    assert status(rig, move_id) is MoveStatus.EXECUTING
    rig.wait(1.5)
    assert status(rig, move_id) is MoveStatus.FAILED


def test_a_new_front_adopts_what_it_finds(rig: Any) -> None:
    rig.ports.durations[3, 77] = 4.0
    rig.show(state=GroupState.HELD, plan_id=77, slot=3, path_s=1.0, reason="front is gone")
    report = rig.actioner.find_move("m-77", rig.world.now_ns)
    assert (report.group, report.status, report.progress) == ("both", MoveStatus.EXECUTING, 0.0)
    rig.observe()
    report = rig.actioner.find_move("m-77", rig.world.now_ns)
    assert (report.status, report.progress, report.duration_s) == (MoveStatus.HELD, 0.25, 4.0)


def test_plan_ids_go_on_above_those_adopted(rig: Any) -> None:
    rig.ports.durations[3, 5000] = 4.0
    rig.show(1, state=GroupState.HELD, plan_id=5000, slot=3)
    rig.move("kingkong", rig.lease("kingkong"))
    assert rig.ports.jobs[0].plan_id == 5001


def test_slots_that_the_controller_holds_are_not_used(rig: Any) -> None:
    rig.show(1, state=GroupState.HELD, plan_id=77, slot=0)
    rig.move("kingkong", rig.lease("kingkong"))
    assert rig.ports.jobs[0].slot == 1


@pytest.mark.parametrize("move_id", ["", "m-", "m-1", "1000", "m-01000", "m--1", "m-" + "9" * 50, "x", "m-१"])
def test_moves_that_are_not(rig: Any, move_id: str) -> None:
    accepted(rig)
    with pytest.raises(Refusal) as caught:
        status(rig, move_id)
    assert caught.value.code is ErrorCode.NOT_FOUND


def test_only_the_newest_thousand_are_kept_beside_those_that_go_on() -> None:
    moves = Moves()
    for plan_id in range(1, 1006):
        moves.add(Move(plan_id, "kingkong", (0,), None, 1.0, 0, accepted=True))
        if plan_id > 1:
            moves.end(plan_id, MoveStatus.SUCCEEDED, None)
    assert [moves.find(f"m-{i}") is not None for i in (1, 2, 5, 6, 1005)] == [True, False, False, True, True]
