import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisync_cli.quantities import (
    TWO_TURNS,
    angular_limits,
    duration_s,
    euler,
    joint_target,
    joint_velocity,
    linear_limits,
    member_and_point,
    picture,
    point,
    quaternion,
    rate,
    speed_scale,
    tool_velocity,
    turn_velocity,
)

RIGHT = math.radians(90)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("-90,90,0deg", (-RIGHT, RIGHT, 0.0)),
        ("-90deg,0.5rad", (-RIGHT, 0.5)),
        ("0.5,-1,+2", (0.5, -1.0, 2.0)),
        ("0.5", (0.5,)),
        ("90deg", (RIGHT,)),
        ("1,2rad", (1.0, 2.0)),
        ("1.2rad", (1.2,)),
        ("90 deg", (RIGHT,)),
        ("90rad", (90.0,)),
        ("0,12.5", (0.0, 12.5)),
        (" -90 , 90 deg ", (-RIGHT, RIGHT)),
        ("1e-3,.5,2.", (0.001, 0.5, 2.0)),
    ],
)
def test_joint_targets(text: str, values: tuple[float, ...]) -> None:
    assert joint_target(text) == pytest.approx(values, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("90deg,0", "some values have a unit and some have none"),
        ("0,90deg,0,1rad", "some values have a unit"),
        ("", "'' is no number"),
        ("1,,2", "'' is no number"),
        ("1,x", "'x' is no number with a unit"),
        ("1,2mm", "the unit 'mm' is none of deg, rad"),
        ("1,2degrees", "the unit 'degrees' is none"),
        ("90", "'90': without a unit these would be radians; write 90deg, or 90rad if they are"),
        ("0,-12.6", "write 0,-12.6deg, or 0,-12.6rad"),
        ("90°", "the unit '°' is none of deg, rad"),
        ("90DEG", "the unit 'DEG' is none of deg, rad"),
        ("90deg/s", "the unit 'deg/s' is none of deg, rad"),
        ("nan,0", "'nan' is no number"),
        ("inf", "'inf' is no number"),
        ("1e999", "too large"),
        ("1 2", "'1 2' is no number"),
        ("--json", "'--json' is no number"),
    ],
)
def test_other_targets_say_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        joint_target(text)


@given(st.lists(st.floats(-TWO_TURNS, TWO_TURNS), min_size=1, max_size=12))
def test_what_is_printed_is_read_back(values: list[float]) -> None:
    assert joint_target(",".join(map(repr, values))) == tuple(values)


@pytest.mark.parametrize(("text", "value"), [("50%", 0.5), ("0.5", 0.5), ("100%", 1.0), ("1", 1.0), ("2.5 %", 0.025)])
def test_speeds(text: str, value: float) -> None:
    assert speed_scale(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["0", "0%", "1.1", "101%", "-50%", "fast", "%", "50%%", "0.5deg"])
def test_other_speeds(text: str) -> None:
    with pytest.raises(ValueError, match=r"must be above 0|is no number|the unit"):
        speed_scale(text)


@pytest.mark.parametrize(("text", "value"), [("30%", 0.3), ("0.3", 0.3), ("0", 0.0), ("0%", 0.0), ("100%", 1.0)])
def test_overrides(text: str, value: float) -> None:
    assert rate(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["30", "101%", "-1%", "30deg", "nan", "half"])
def test_other_overrides(text: str) -> None:
    with pytest.raises(ValueError, match=r"must be 0 to 1 \(100%\)|is no number|the unit"):
        rate(text)


def test_velocities() -> None:
    """Zeros need no unit beside a value that has one."""
    five = math.radians(5)
    assert joint_velocity("0,0,5deg,0,0,0") == pytest.approx((0, 0, five, 0, 0, 0))
    assert joint_velocity("0,5deg/s") == pytest.approx((0, five))
    assert joint_velocity("0.1,0.2") == (0.1, 0.2)
    assert tool_velocity("0,20mm,0") == pytest.approx((0, 0.02, 0))
    assert tool_velocity("0,0,-20mm/s") == pytest.approx((0, 0, -0.02))
    assert turn_velocity("5deg,0,0") == pytest.approx((five, 0, 0))


@pytest.mark.parametrize(("text", "value"), [("8", 8.0), ("8s", 8.0), ("8.5 s", 8.5), ("8500ms", 8.5)])
def test_durations(text: str, value: float) -> None:
    assert duration_s(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["0", "-1", "1h", "soon", "1e6"])
def test_other_durations(text: str) -> None:
    with pytest.raises(ValueError, match=r"must be above 0|is no number|the unit"):
        duration_s(text)


def test_points_angles_and_limits() -> None:
    assert point("300,0,-120.5mm") == pytest.approx((0.3, 0.0, -0.1205), abs=1e-15)
    assert point("0.3, 0, 0.1") == (0.3, 0.0, 0.1)
    assert point("1m,2mm,3m") == (1.0, 0.002, 3.0)
    assert member_and_point("kingkong=1,2,3m") == ("kingkong", (1.0, 2.0, 3.0))
    assert member_and_point("1,2,3m") == (None, (1.0, 2.0, 3.0))
    assert euler("0,90,0deg") == pytest.approx((0.0, RIGHT, 0.0))
    assert quaternion("0,0,0.6,-0.8") == (0.0, 0.0, 0.6, -0.8)
    assert linear_limits("150,200,300mm") == pytest.approx((0.15, 0.2, 0.3))
    assert angular_limits("90,90,90deg") == pytest.approx((RIGHT,) * 3)


@pytest.mark.parametrize(
    ("parse", "text", "message"),
    [
        (point, "1,2mm", "must be 3 values, x, y and z, not 2"),
        (point, "1,2,3deg", "the unit 'deg' is none of mm, m"),
        (point, "1mm,2,3", "some values have a unit"),
        (member_and_point, "a=b=1", "must be 3 values"),
        (euler, "1,2,3mm", "the unit 'mm' is none of deg, rad"),
        (quaternion, "0,0,0", "must be 4 values"),
        (quaternion, "0,0,0,1deg", "the unit 'deg'"),
        (linear_limits, "1,2", "velocity, acceleration and jerk"),
        (joint_velocity, "1,5deg,0", "some values have a unit"),
        (joint_velocity, "5mm,0", "the unit 'mm' is none of deg, rad"),
        (tool_velocity, "0,20mm", "must be 3 values, along x, y and z, not 2"),
        (tool_velocity, "0,0,5deg", "the unit 'deg' is none of mm, m"),
        (turn_velocity, "0,0,5mm", "the unit 'mm' is none of deg, rad"),
        (picture, "move.gif", "must end in .svg or .png"),
    ],
)
def test_others_say_what_is_wrong(parse: Callable[[str], object], text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse(text)
