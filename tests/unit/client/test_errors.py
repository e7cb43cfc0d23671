import math

import pytest

from axisync_client import MoveHeld, Refused, Unavailable
from axisync_client.fixes import fix_of
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.replies import MoveReport


@pytest.mark.parametrize(
    ("details", "fix"),
    [
        ({}, None),
        ({"fix": "acquire a new one"}, "acquire a new one"),
        ({"max_feasible_speed_scale": 0.5}, "the highest feasible speed_scale is 0.5"),
        ({"fix": {"shortest_duration_s": 5.25}}, "the shortest possible duration is 5.25 s"),
        ({"groups": ["kingkong", "all"]}, "the groups are kingkong, all"),
        ({"groups": {"kingkong": "ann"}, "axis": "kingkong.1"}, None),
        ({"max_feasible_speed_scale": 0.39894237}, "the highest feasible speed_scale is 0.398942"),
        ({"shortest_duration_s": 5.2500001}, "the shortest possible duration is 5.25001 s"),
        ({"shortest_duration_s": 5}, "the shortest possible duration is 5 s"),
        ({"max_feasible_speed_scale": math.nan}, None),
        ({"fix": {"group": "both"}, "group": "kingkong"}, "move both as one, as group both"),
        ({"group": "kingkong"}, None),
        ({"fix": {"wait_for": "wukong"}}, "wait until wukong has ended its move"),
        (
            {"nearest_reachable": {"position": [0.4, -0.01, 1e-9], "quaternion": [0.0, 0.0, 0.6, 0.8]}},
            "the nearest reachable pose is 400.00,-10.00,0.00mm, quaternion 0.00000,0.00000,0.60000,0.80000",
        ),
        ({"nearest_reachable": {"position": [0.4, 0.0, 0.0]}}, "the nearest reachable pose is 400.00,0.00,0.00mm"),
    ],
)
def test_fixes_in_words(details: dict[str, object], fix: str | None) -> None:
    assert fix_of(details) == fix


def test_a_refusal_keeps_the_body() -> None:
    body = ErrorBody(request_id="7", code=ErrorCode.SOFT_LIMIT, message="beyond", details={"axis": "kingkong.1"})
    error = Refused(body)
    assert (error.code, error.message, error.details, error.request_id) == ("SOFT_LIMIT", "beyond", body.details, "7")
    assert error.body() is body
    assert str(error) == "SOFT_LIMIT: beyond"


def test_errors_of_the_client_have_a_body_too() -> None:
    body = Unavailable("nobody answers", "start it").body()
    assert (body.code, body.message, body.details) == ("UNAVAILABLE", "nobody answers", {"fix": "start it"})


def test_a_move_that_did_not_arrive_says_why() -> None:
    report = MoveReport(
        move_id="m-1",
        group="both",
        status=MoveStatus.HELD,
        progress=0.5,
        reason="lapsed",
        duration_s=1.0,
        now_s=0.0,
    )
    assert str(MoveHeld(report)) == "move m-1 of both is held: lapsed"
