"""Shapes along planned motions: the arm itself, the body, the other arm at rest and on its path, drives left alone."""

import math
from typing import Any

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.errors import ErrorCode
from axisync_service.planner.models import Models
from support.planner_jobs import (
    FREE,
    MODELS,
    P1,
    P2,
    REST,
    TEXT,
    WUKONG,
    at,
    degrees,
    linear,
    plan_of,
    planned,
    refused,
)

ACROSS = degrees(75, -10, 20, -55, 145, -35)
"""KingKong reaching over the body to the other side."""
OVER = degrees(-115, 40, -35, 65, 45, -20)
"""WuKong doing the same."""
DOWN = (0.0, 1.0, 0.0, 0.0)


def joint(target: Any, **options: Any) -> dict[str, Any]:
    return {"kind": "joint", "target": tuple(target), **options}


def test_the_least_distance_is_in_the_reply_and_what_drives_do_alone_is_less() -> None:
    reply = planned(joint(P2), MODELS).reply
    assert reply.min_distance_m is not None
    assert reply.alone is not None
    assert reply.alone.min_distance_m is not None
    assert 0.005 < reply.min_distance_m < 0.0928 - 2 * 0.035 + 1e-6
    assert 0.0 < reply.alone.min_distance_m < reply.min_distance_m
    assert reply.nearest == ("kingkong link 3", "kingkong link 5")


def test_without_shapes_there_is_no_distance() -> None:
    reply = planned(joint(P2), FREE).reply
    assert (reply.min_distance_m, reply.nearest) == (None, None)
    assert reply.alone is not None
    assert reply.alone.min_distance_m is None


@pytest.mark.parametrize(
    ("target", "pair"),
    [
        (degrees(0, -150, 168, -45, -45, 45), ["kingkong link 1", "kingkong link 3"]),
        (degrees(0, 0, 60, -45, -45, 45), ["kingkong link 4", "body"]),
    ],
)
def test_the_arm_itself_and_the_body(target: tuple[float, ...], pair: list[str]) -> None:
    error = refused(joint(target, duration_s=60.0), MODELS)
    assert error.code is ErrorCode.COLLISION
    assert error.details["pair"] == pair
    assert error.details["margin_m"] == 0.005
    assert error.details["distance_m"] < 0.0055
    assert 0.0 < error.details["time_s"] < 60.0
    assert len(error.details["position"]) == 6
    assert "fix" not in error.details
    assert planned(joint(target), FREE).plan is not None


def test_just_before_the_point_named_the_motion_is_clear() -> None:
    target = degrees(0, -150, 168, -45, -45, 45)
    error = refused(joint(target, duration_s=60.0), MODELS)
    to = [a + 0.99 * (b - a) for a, b in zip(P1, error.details["position"], strict=True)]
    assert planned(joint(to, duration_s=60.0), MODELS).plan is not None


def test_speed_counts_for_drives_left_alone() -> None:
    """Beside the body: no path that touches, but none that could be run past fast."""
    target = degrees(0, -20, 60, -45, -45, 45)
    error = refused(joint(target), MODELS)
    assert error.code is ErrorCode.COLLISION
    assert error.details["alone"] is True
    assert "by themselves" in error.message
    slow = planned(joint(target, duration_s=120.0), MODELS) if error.details["distance_m"] > 0.0 else None
    assert slow is None or slow.plan is not None


def test_the_other_arm_standing_in_the_way() -> None:
    assert planned(joint(OVER), MODELS, group="wukong", start=WUKONG).plan is not None
    error = refused(joint(OVER), MODELS, group="wukong", start=WUKONG, rest=ACROSS + WUKONG)
    assert error.code is ErrorCode.COLLISION
    assert [name.split()[0] for name in error.details["pair"]] == ["kingkong", "wukong"]


def test_the_other_arm_on_its_way_has_its_whole_path() -> None:
    """Though it has not begun, and though it would be gone in time: clocks of their own."""
    other = plan_of(planned(joint(P1), MODELS, start=ACROSS, rest=ACROSS + WUKONG))
    away = planned(joint(OVER), MODELS, group="wukong", start=WUKONG, rest=P1 + WUKONG)
    assert away.plan is not None
    for now in (ACROSS, P1):
        error = refused(joint(OVER), MODELS, (other,), group="wukong", start=WUKONG, rest=now + WUKONG)
        assert error.code is ErrorCode.COLLISION
        assert error.details["fix"] == {"group": "both"}
        assert "kingkong" in error.message


def test_paths_that_keep_apart_are_planned_beside_each_other() -> None:
    other = plan_of(planned(joint(P2), MODELS))
    move = joint((0.1, 0.1, 0.0, 0.0, 0.0, 0.0), relative=True)
    alone = planned(move, MODELS, group="wukong", start=WUKONG).reply
    beside = planned(move, MODELS, (other,), group="wukong", start=WUKONG).reply
    assert beside.min_distance_m is not None
    assert alone.min_distance_m is not None
    assert beside.min_distance_m <= alone.min_distance_m


def test_under_one_clock_time_counts() -> None:
    """One arm leaves as the other comes: refused on two clocks, planned on one, where they never are together."""
    leaves = {"kind": "sequence", "steps": (
        joint([*P1, *WUKONG]), joint([*P1, *OVER]),
    )}  # fmt: skip
    assert planned(leaves, MODELS, group="both", start=ACROSS + WUKONG, rest=ACROSS + WUKONG).plan is not None
    both = joint([*ACROSS, *OVER])
    error = refused(both, MODELS, group="both", start=P1 + WUKONG)
    assert error.code is ErrorCode.COLLISION
    assert "fix" not in error.details


def test_without_a_compound_the_fix_is_to_wait() -> None:
    text = TEXT[: TEXT.index("# Both arms as one group")] + TEXT[TEXT.index("# What the arms keep clear of") :]
    models = Models(parse_cell(text))
    other = plan_of(planned(joint(P1), models, start=ACROSS, rest=ACROSS + WUKONG))
    error = refused(joint(OVER), models, (other,), group="wukong", start=WUKONG, rest=P1 + WUKONG)
    assert error.details["fix"] == {"wait_for": "kingkong"}


def above(z: float, **options: Any) -> dict[str, Any]:
    return linear(at((-0.31, 0.2, z), quaternion=DOWN), frame="body", **options)


def test_contacts_of_the_cell_file_may_touch_in_the_steps_that_say_so() -> None:
    ready = joint(degrees(-133, -116, -89, -123, 52, -21))
    over = {"kind": "joint", "target": at((-0.31, 0.2, 0.25), quaternion=DOWN), "frame": "body"}
    contacts = (("kingkong.6", "equipment"),)
    begin = degrees(-90, -150, 45, -90, -90, -90)

    def steps(*last: dict[str, Any]) -> dict[str, Any]:
        return {"kind": "sequence", "steps": (ready, over, *last)}

    error = refused(steps(above(0.06)), MODELS, start=begin)
    assert (error.code, error.details["step"]) == (ErrorCode.COLLISION, 2)
    assert error.details["pair"] == ["kingkong link 6", "equipment"]
    down, up = above(0.06, contacts=contacts), above(0.25, contacts=contacts)
    assert planned(steps(down, up), MODELS, start=begin).plan is not None
    error = refused(steps(down, above(0.25)), MODELS, start=begin)
    assert (error.code, error.details["step"]) == (ErrorCode.COLLISION, 3)


def test_contacts_that_the_cell_file_does_not_have() -> None:
    error = refused(joint(P2, contacts=(("kingkong.5", "body"),)), MODELS)
    assert error.code is ErrorCode.INVALID_REQUEST
    assert error.details["errors"][0]["path"] == "move.contacts"


def test_no_drive_alone_leaves_its_hard_limits() -> None:
    """On a path of the tool as well: to where soft and hard limits are all but one."""
    narrow = TEXT.replace("hard_limits_deg = [-210, 180]", "hard_limits_deg = [-200.5, 180]")
    models = Models(
        parse_cell(narrow.replace("quick_stop_deceleration_deg_s2 = 90", "quick_stop_deceleration_deg_s2 = 20"))
    )
    start = degrees(-90, -190, 45, -90, -90, -90)
    move = joint(degrees(0, -9.9, 0, 0, 0, 0), relative=True)
    error = refused(move, models, start=start)
    assert error.code is ErrorCode.JOINT_LIMIT
    assert error.details["axis"] == "kingkong.2"
    assert error.details["required"] < error.details["allowed"] == math.radians(-200.5)
    reply = planned(move, models, start=start, speed_scale=0.2).reply
    assert reply.alone is not None
    assert 0.0 < reply.alone.limit_margin < math.radians(1.1)


def test_where_nothing_moves_nothing_is_checked() -> None:
    """An arm that stands too near something must be able to say so; it can be moved away by hand or `jog`."""
    still = planned(joint((0.0,) * 6, relative=True), MODELS, start=degrees(0, 0, 60, -45, -45, 45))
    assert still.plan is None


def test_what_rests_is_every_other_axis_of_the_cell() -> None:
    assert len(REST) == 12
    moved = np.array(planned(joint(P2), MODELS).reply.end)
    assert moved.tolist() == list(P2)
