"""What a held pad stands for."""

import pytest

from axisync_dashboard.jogging import LINEAR_M_S, jog_call, pads_of, velocity_of
from axisync_schemas.cell import read_cell
from support.arms import EOD

CELL = read_cell(EOD)[0]


def test_a_joint_pad_moves_one_axis_at_a_share_of_its_limit() -> None:
    velocity = velocity_of(CELL, "wukong", "joint", 2, -1, 0.2)
    limit = CELL.groups[1].axes[2].limits.velocity
    assert velocity == (0.0, 0.0, pytest.approx(-0.2 * limit), 0.0, 0.0, 0.0)
    assert len(pads_of(CELL, "both", "joint")) == 12


def test_a_tool_pad_moves_along_or_about_a_direction() -> None:
    assert velocity_of(CELL, "wukong", "body", 1, 1, 0.5)[:3] == (0.0, 0.5 * LINEAR_M_S, 0.0)
    assert pads_of(CELL, "wukong", "tool")[3] == "about x"


@pytest.mark.parametrize(("pad", "sign"), [(6, 1), (-1, 1), (0, 0), (0, 5)])
def test_there_are_no_other_pads(pad: int, sign: int) -> None:
    with pytest.raises(ValueError, match="pad"):
        velocity_of(CELL, "kingkong", "joint", pad, sign, 1.0)


def test_the_request_is_the_contracts() -> None:
    call = jog_call("kingkong", "joint", (0.1, 0.0), "token")
    assert call.key("eod", "me") == "axisync/eod/cmd/me/jog"
    body = call.payload(12.5).decode()
    for part in ('"group":"kingkong"', '"space":"joint"', '"velocity":[0.1,0.0]', '"ttl_s":0.3', '"not_after_s":12.5'):
        assert part in body
