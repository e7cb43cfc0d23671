"""Jogs in the actioner: what is planned, what is refreshed, what replaces what, and what needs a fresh start."""

from collections.abc import Callable
from typing import Any

import pytest

from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.internal import (
    JOG_LAPSED,
    JOG_RELEASED,
    BeginCommand,
    ControllerEvent,
    ControllerReply,
    Jog,
    JogCommand,
    PlanResult,
)
from axisync_schemas.replies import Event, JogAhead, MoveReply
from axisync_service.actioner.jogger import BLOCKED_NS, QUIET_NS
from axisync_service.actioner.ports import Answer

Read = Callable[[list[Answer]], dict[str, Any]]
SLOW, FAST, BACK, UP = [0.1, 0, 0, 0, 0, 0], [0.2, 0, 0, 0, 0, 0], [-0.1, 0, 0, 0, 0, 0], [0, 0.1, 0, 0, 0, 0]
NONE = [0.0] * 6


def ask(rig: Any, velocity: list[float] = SLOW, **fields: Any) -> list[Answer]:
    given = {"group": "kingkong", "lease": rig.lease_token, "velocity": velocity}
    answers: list[Answer] = rig.send("jog", **(given | fields))
    return answers


def plan(rig: Any, share: float = 1.0) -> None:
    """The planner has found a way."""
    job = rig.ports.jobs[-1]
    assert isinstance(job.move, Jog)
    reply = MoveReply(
        request_id="", now_s=0.0, move_id=None, group=job.group, duration_s=5.0, scalars=(), T=(), U=(),
        minimum_s=(), limiting=None,
    )  # fmt: skip
    ahead = JogAhead(velocity=tuple(share * v for v in job.move.velocity), limited_by="a cap" if share < 1.0 else None)
    rig.actioner.on_plan(PlanResult(ref=job.ref, plan=reply, jog=ahead), rig.observe())


def block(rig: Any, code: ErrorCode = ErrorCode.SOFT_LIMIT) -> None:
    error = ErrorBody(code=code, message="no way", details={"fix": "jog the other way"})
    rig.actioner.on_plan(PlanResult(ref=rig.ports.jobs[-1].ref, error=error), rig.observe())


def done(rig: Any, error: ErrorBody | None = None) -> None:
    """The controller has done the last command."""
    reply = ControllerReply(ref=rig.ports.commands[-1].ref, tick=1, error=error)
    rig.actioner.on_controller(reply, rig.observe())


def begin(rig: Any, velocity: list[float] = SLOW, share: float = 1.0) -> tuple[list[Answer], BeginCommand]:
    """A jog under way."""
    if not rig.lease_token:
        rig.lease("kingkong")
    answers = ask(rig, velocity)
    plan(rig, share)
    command = rig.ports.commands[-1]
    done(rig)
    rig.show(0, state=GroupState.JOGGING, plan_id=command.plan_id, slot=command.slot)
    return answers, command


def end(rig: Any, plan_id: int, reason: str | None) -> None:
    """The group stands."""
    rig.show(0, state=GroupState.STANDSTILL, plan_id=0, slot=-1)
    details = {"plan_id": plan_id, "status": "stopped" if reason else "succeeded", "reason": reason}
    event = Event(source="controller", kind="move_ended", now_s=0, wall_time="", message="", tick=1, details=details)
    rig.actioner.on_controller(ControllerEvent(event=event), rig.observe())


def test_it_is_planned_begun_and_answered(rig: Any, ok: Read) -> None:
    now_ns = rig.world.now_ns
    answers, command = begin(rig)
    job = rig.ports.jobs[0]
    assert job.move == Jog(space="joint", velocity=tuple(map(float, SLOW)))
    assert command.jog_until_ns == now_ns + 200_000_000
    reply = ok(answers)
    assert (reply["state"], reply["move_id"]) == ("moving", f"m-{command.plan_id}")
    assert reply["ahead"]["velocity"] == SLOW
    first = rig.ports.commands[-1]
    assert isinstance(first, JogCommand), "what was asked for while it began"
    assert first.share == 1.0
    logged = [data for topic, data, *_ in rig.ports.logged if topic == "/plans"]
    assert logged[0]["move"] == {"kind": "jog", "space": "joint", "velocity": SLOW}


def test_each_request_prolongs_it(rig: Any, ok: Read) -> None:
    begin(rig)
    rig.wait(0.1)
    answers = ask(rig, ttl_s=0.3)
    command = rig.ports.commands[-1]
    assert (command.share, command.until_ns) == (1.0, rig.world.now_ns + 300_000_000)
    assert answers == []
    done(rig)
    assert ok(answers)["state"] == "moving"
    assert len(rig.ports.jobs) == 1


def test_slower_along_the_same_way_is_a_share(rig: Any) -> None:
    begin(rig, FAST)
    ask(rig, SLOW)
    assert rig.ports.commands[-1].share == pytest.approx(0.5)


def test_of_what_is_in_force_where_that_is_less_than_asked(rig: Any) -> None:
    begin(rig, FAST, share=0.5)
    for first, share in ((0.1, 1.0), (0.05, 0.5), (0.15, 1.0), (9.0, 1.0)):
        ask(rig, [first, 0, 0, 0, 0, 0])
        assert rig.ports.commands[-1].share == pytest.approx(share)


@pytest.mark.parametrize("velocity", [FAST, BACK, UP])
def test_any_other_velocity_replaces_it_from_rest(rig: Any, ok: Read, velocity: list[float]) -> None:
    _, command = begin(rig)
    answers = ask(rig, velocity)
    assert rig.ports.commands[-1].share == 0.0
    done(rig)
    assert ok(answers)["state"] == "starting"
    assert ok(ask(rig, velocity))["state"] == "starting"
    assert len(rig.ports.jobs) == 1
    end(rig, command.plan_id, JOG_RELEASED)
    assert rig.ports.jobs[-1].move.velocity == tuple(map(float, velocity))
    plan(rig)
    assert isinstance(rig.ports.commands[-1], BeginCommand)


def test_at_the_end_of_one_plan_it_goes_on(rig: Any) -> None:
    _, command = begin(rig)
    end(rig, command.plan_id, None)
    assert len(rig.ports.jobs) == 2
    rig.wait(1.0)
    plan(rig)
    assert not isinstance(rig.ports.commands[-1], BeginCommand), "nobody asks for it any longer"


def test_asked_for_while_it_is_planned(rig: Any, ok: Read, no: Read) -> None:
    rig.lease("kingkong")
    first = ask(rig)
    rig.wait(0.15)
    assert ok(ask(rig))["state"] == "starting"
    rig.wait(0.15)
    plan(rig)
    assert rig.ports.commands[-1].jog_until_ns == rig.world.now_ns + 50_000_000
    assert first == []


def test_planned_too_late_it_does_not_begin(rig: Any, no: Read) -> None:
    rig.lease("kingkong")
    answers = ask(rig)
    rig.wait(0.3)
    plan(rig)
    assert no(answers)["code"] == "STALE"
    assert rig.ports.commands == []


def test_another_velocity_while_it_is_planned(rig: Any) -> None:
    rig.lease("kingkong")
    ask(rig)
    ask(rig, BACK)
    plan(rig)
    done(rig)
    assert rig.ports.commands[-1].share == 0.0
    end(rig, rig.ports.commands[-1].plan_id, JOG_RELEASED)
    assert rig.ports.jobs[-1].move.velocity == tuple(map(float, BACK))


def test_letting_go_is_answered_when_the_group_stands(rig: Any, ok: Read) -> None:
    _, command = begin(rig)
    answers = ask(rig, NONE)
    assert rig.ports.commands[-1].share == 0.0
    done(rig)
    assert answers == []
    end(rig, command.plan_id, JOG_RELEASED)
    assert ok(answers)["state"] == "standing"
    assert len(rig.ports.jobs) == 1
    assert ok(ask(rig, NONE))["state"] == "standing"


def test_let_go_before_it_began(rig: Any, ok: Read, no: Read) -> None:
    rig.lease("kingkong")
    first, last = ask(rig), ask(rig, NONE)
    plan(rig)
    assert no(first)["code"] == "WRONG_STATE"
    assert ok(last)["state"] == "standing"
    assert rig.ports.commands == []


def test_no_way_there_is_said_again_without_planning_again(rig: Any, no: Read) -> None:
    rig.lease("kingkong")
    answers = ask(rig)
    block(rig)
    assert no(answers)["code"] == "SOFT_LIMIT"
    assert no(ask(rig))["details"] == {"fix": "jog the other way"}
    assert len(rig.ports.jobs) == 1
    assert ask(rig, BACK) == []
    assert len(rig.ports.jobs) == 2
    block(rig)
    rig.wait(BLOCKED_NS / 1e9)
    assert ask(rig, BACK) == []
    assert len(rig.ports.jobs) == 3


@pytest.mark.parametrize("reason", ["stop", "hold", "lease lapsed", "kingkong.1: following error"])
def test_after_a_stop_the_key_must_be_let_go(rig: Any, no: Read, reason: str) -> None:
    _, command = begin(rig)
    end(rig, command.plan_id, reason)
    for _ in range(10):
        rig.wait(0.1)
        refused = no(ask(rig))
        assert refused["code"] == "WRONG_STATE"
        assert "let go" in refused["details"]["fix"]
    rig.wait(QUIET_NS / 1e9 + 0.01)
    assert ask(rig) == []
    assert len(rig.ports.jobs) == 2


def test_a_stop_counts_before_the_group_stands(rig: Any, no: Read) -> None:
    begin(rig)
    rig.ports.stops[0] += 1
    commands = len(rig.ports.commands)
    assert no(ask(rig))["code"] == "WRONG_STATE"
    assert len(rig.ports.commands) == commands


def test_a_pause_of_the_client_is_no_stop(rig: Any) -> None:
    _, command = begin(rig)
    rig.wait(0.5)
    end(rig, command.plan_id, JOG_LAPSED)
    assert len(rig.ports.jobs) == 1
    assert ask(rig) == []
    assert len(rig.ports.jobs) == 2


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"velocity": [0.1]}, "INVALID_REQUEST"),
        ({"space": "tool"}, "INVALID_REQUEST"),
        ({"space": "tool", "velocity": [0.1, 0.0]}, "INVALID_REQUEST"),
        ({"velocity": []}, "INVALID_REQUEST"),
        ({"ttl_s": 5.0}, "INVALID_REQUEST"),
        ({"ttl_s": 0.0}, "INVALID_REQUEST"),
        ({"space": "world"}, "INVALID_REQUEST"),
        ({"group": "nobody"}, "INVALID_REQUEST"),
        ({"lease": None}, "LEASE_REQUIRED"),
        ({"lease": "x"}, "LEASE_FENCED"),
        ({"not_after_s": 1.0}, "STALE"),
    ],
)
def test_bad_requests(rig: Any, no: Read, fields: dict[str, Any], code: str) -> None:
    rig.lease("kingkong")
    if fields.get("space") == "tool" and "velocity" not in fields:
        fields = {"space": "tool", "velocity": [0.1] * 4}
    assert no(ask(rig, **fields))["code"] == code
    assert rig.ports.jobs == []


@pytest.mark.parametrize(
    ("state", "code"),
    [(GroupState.DISABLED, "NOT_ENABLED"), (GroupState.MOVING, "BUSY"), (GroupState.HELD, "WRONG_STATE"),
     (GroupState.FAULT, "FAULTED"), (GroupState.HOMING, "BUSY")],
)  # fmt: skip
def test_only_from_standstill(rig: Any, no: Read, state: GroupState, code: str) -> None:
    rig.lease("kingkong")
    rig.show(0, state=state)
    assert no(ask(rig))["code"] == code


def test_a_group_that_is_jogged_takes_no_move(rig: Any, no: Read) -> None:
    begin(rig)
    assert no(rig.move("kingkong", rig.lease_token))["code"] == "BUSY"


def test_a_lost_lease_ends_the_right_to_go_on(rig: Any, no: Read) -> None:
    begin(rig)
    rig.send("lease", action="take", groups=["kingkong"], user="other")
    assert no(ask(rig))["code"] == "LEASE_FENCED"


def test_the_controller_goes_down(rig: Any, ok: Read) -> None:
    begin(rig)
    last = ask(rig, NONE)
    rig.world = type(rig.world)(**{f: getattr(rig.world, f) for f in rig.world.__slots__} | {"up": False})
    rig.observe()
    assert ok(last)["state"] == "standing"
