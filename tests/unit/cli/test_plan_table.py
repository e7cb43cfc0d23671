import io
import math

import numpy as np
import pytest
from rich.console import Console

from axisync_cli.plan_table import number, peaks, plan_table, summary
from axisync_cli.scalars import Scalar
from axisync_motion import synchronise
from axisync_schemas.replies import AloneReport, MoveReply


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("distance", [-90.0, 5.0, 0.01])
def test_peaks_agree_with_the_sampled_curve(pulse: str, distance: float) -> None:
    profile = synchronise([distance, 100.0], [30.0] * 2, [40.0] * 2, [80.0] * 2, pulse=pulse)  # type: ignore[arg-type]
    ends = np.cumsum(np.insert(profile.T, 0, 0.0, axis=1), axis=1)
    middles = 0.5 * (ends[:, 1:] + ends[:, :-1])  # of each segment: a short pulse lies between any other samples
    times = np.concatenate([ends.ravel(), middles.ravel(), np.linspace(0.0, profile.duration, 100)])
    _, velocity, acceleration, jerk = (np.abs(values).max(axis=0) for values in profile.sample(times))
    for axis in range(2):
        row = peaks(tuple(profile.T[axis]), tuple(profile.U[axis]), pulse)  # type: ignore[arg-type]
        assert row.velocity == pytest.approx(velocity[axis], rel=1e-3)
        assert row.acceleration == pytest.approx(acceleration[axis], rel=1e-6)
        assert row.jerk == pytest.approx(jerk[axis], rel=1e-6)


def test_an_axis_that_rests() -> None:
    assert peaks((0.0,) * 7, (0.0,) * 7, "constant") == (0.0, 0.0, 0.0)


def test_two_seconds_of_unit_jerk_by_hand() -> None:
    top = peaks((1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0), (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0), "constant")
    assert top == pytest.approx((1.0, 1.0, 1.0))
    assert not math.isnan(top.velocity)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(90.0, "90.00"), (-0.0, "0.00"), (-1e-14, "0.00"), (2.4e-6, "0.00"), (-4.9e-4, "0.00"), (-5.1e-4, "-0.001"),
     (0.0123, "0.012"), (-0.05, "-0.050"), (0.0949999, "0.095"), (0.1, "0.10"), (-10.004, "-10.00"),
     (123.456, "123.46")],
)  # fmt: skip
def test_numbers_are_short_and_hide_no_motion(value: float, shown: str) -> None:
    assert number(value) == shown


def test_a_hard_move_fits_into_80_columns() -> None:
    start, end = [0.0, -150.0, 0.0], [170.0, 170.0, 0.5]
    profile = synchronise(np.radians(np.subtract(end, start)), [3.0] * 3, [20.0] * 3, [200.0] * 3, "jerk")
    names = tuple(f"kingkong.{i + 1}" for i in range(3))
    reply = MoveReply(
        request_id="", now_s=0.0, move_id=None, group="kingkong", duration_s=profile.duration, scalars=names,
        T=tuple(map(tuple, profile.T.tolist())), U=tuple(map(tuple, profile.U.tolist())),
        minimum_s=tuple(profile.minimum_durations.tolist()), limiting=names[1],
    )  # fmt: skip
    console = Console(width=80, record=True, file=io.StringIO())
    scalars = tuple(Scalar(name, "deg", math.radians(at), True) for name, at in zip(names, start, strict=True))
    table = plan_table(reply, scalars, "constant")
    console.print(table)
    shown = console.export_text()
    assert "…" not in shown
    assert "kingkong.2 *" in shown
    assert "-11459" in shown
    assert all(f"{value:.2f}" in shown for value in (*start, *end))
    assert console.measure(table).minimum <= 80


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({}, "k would take 2.000 s: nothing moves"),
        ({"limiting": "length"}, "k would take 2.000 s, limited by length"),
        ({"limiting": "k.5", "scale": 1.8}, "\nstretched 1.8 times, or k.5 would exceed its limits"),
        ({"min_distance_m": 0.0123, "nearest": ("k.3", "body")}, "\nk.3 and body come nearest, 12.3 mm apart"),
        (
            {"alone": AloneReport(limit_margin=0.1, axis="k.2", min_distance_m=0.004)},
            "\ndrives that stop by themselves would leave 5.7 deg to the hard limit of k.2 and 4.0 mm between shapes",
        ),
        ({"alone": AloneReport(limit_margin=0.1, axis="k.2")}, "to the hard limit of k.2"),
        ({"end": (0.1, 0.0)}, "\nends with the joints at 5.73,0.00deg"),
        ({"warnings": ("slow",)}, "\nwarning: slow"),
    ],
)
def test_what_is_said_of_a_plan(fields: dict[str, object], said: str) -> None:
    reply = MoveReply(
        request_id="", now_s=0.0, move_id=None, group="k", duration_s=2.0, scalars=("length",), T=((0.0,) * 7,),
        U=((0.0,) * 7,), minimum_s=(0.0,), limiting=None,
    ).model_copy(update=fields)  # fmt: skip
    text = summary(reply, (Scalar("length", "mm", 0.0, False),))
    assert said in text
    assert text.endswith(said.rpartition("\n")[2])
