"""Curves drawn from T and U alone are those of the planner."""

import numpy as np
import pytest

from axisync_cli.plan_curves import curves, sampled
from axisync_cli.scalars import Scalar
from axisync_motion import synchronise
from axisync_schemas.replies import MoveReply

DISTANCES = [-90.0, 0.0, 5.0, 0.01]


@pytest.mark.parametrize("pulse", ["constant", "parabolic"])
@pytest.mark.parametrize("minimise", ["velocity", "acceleration", "jerk"])
def test_sampled_is_the_planners_curve(minimise: str, pulse: str) -> None:
    profile = synchronise(DISTANCES, [30.0] * 4, [40.0] * 4, [80.0] * 4, minimise, pulse=pulse)  # type: ignore[arg-type]
    for axis in range(4):
        times, states = sampled(tuple(profile.T[axis]), tuple(profile.U[axis]), pulse)  # type: ignore[arg-type]
        assert times[0] == 0.0
        assert times[-1] == pytest.approx(profile.duration)
        expected = np.array(profile.sample(times))[:, :, axis]
        for order in range(3):
            scale = np.abs(expected[order]).max() or 1.0
            assert states[order] == pytest.approx(expected[order], abs=1e-9 * scale)
        assert np.abs(states[3]).max() == pytest.approx(np.abs(profile.U[axis]).max(), rel=1e-12)


def test_the_jerk_steps_with_both_of_its_values() -> None:
    times, states = sampled((1.0, 0.0, 1.0, 2.0, 1.0, 0.0, 1.0), (6.0, 0.0, -6.0, 0.0, -6.0, 0.0, 6.0), "constant")
    at_one = states[3][times == 1.0]
    assert at_one.tolist() == [6.0, -6.0]
    assert not states[:, 0].any()
    assert not states[1:, -1].any()
    assert states[1].max() == 6.0
    assert states[0, -1] == pytest.approx(24.0)


def test_the_parabola_is_continuous_and_symmetric() -> None:
    times, states = sampled((1.0, 0.5, 1.0, 0.0, 1.0, 0.5, 1.0), (6.0, 0.0, -6.0, 0.0, -6.0, 0.0, 6.0), "parabolic")
    assert np.abs(np.diff(states[3])).max() < 2.0
    assert states[3].max() == 6.0
    assert states[2].max() == pytest.approx(4.0)
    assert states[1, -2] == pytest.approx(0.0, abs=1e-12)
    assert times[-1] == 5.0


def test_curves_begin_where_the_axis_stands() -> None:
    reply = MoveReply(
        request_id="", now_s=0.0, move_id=None, group="g", duration_s=4.0, scalars=("g.1", "g.2"), limiting="g.1",
        T=((1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0), (1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0)),
        U=((1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0), (0.0,) * 7), minimum_s=(4.0, 0.0),
    )  # fmt: skip
    scalars = (Scalar("g.1", "deg", np.pi, True), Scalar("g.2", "deg", -np.pi / 2, True))
    drawn = curves(reply, scalars, "constant")
    assert drawn.names == ("g.1", "g.2")
    assert drawn.duration == 4.0
    assert [values[0, 0] for values in drawn.values] == pytest.approx([180.0, -90.0])
    assert [values[0, -1] for values in drawn.values] == pytest.approx([180.0 + np.degrees(2.0), -90.0])


def test_lengths_and_angles_of_a_path_in_their_own_units() -> None:
    reply = MoveReply(
        request_id="", now_s=0.0, move_id=None, group="g", duration_s=4.0, scalars=("length", "rotation"),
        limiting="length", T=((1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0),) * 2, minimum_s=(4.0, 0.0),
        U=((0.05, 0.0, -0.05, 0.0, -0.05, 0.0, 0.05),) * 2,
    )  # fmt: skip
    drawn = curves(reply, (Scalar("length", "mm", 0.0, False), Scalar("rotation", "deg", 0.0, False)), "constant")
    assert (drawn.names, drawn.unit) == (("length, mm", "rotation, deg"), "mm, deg")
    assert [values[0, -1] for values in drawn.values] == pytest.approx([100.0, np.degrees(0.1)])


def test_nothing_moves() -> None:
    times, states = sampled((0.0,) * 7, (0.0,) * 7, "constant")
    assert times.tolist() == [0.0, 0.0]
    assert not states.any()
