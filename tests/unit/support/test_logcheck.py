"""The log checker finds what is wrong, and nothing in a good log."""

from functools import cache

import numpy as np
import pytest

from axisync_schemas.cell import Cell, parse_cell, read_cell
from axisync_schemas.enumerations import GroupState
from support import logcheck
from support.logread import Log
from support.recording import CELL
from support.synthetic import REST_TICKS, Session


@cache
def cell() -> Cell:
    return read_cell(CELL)[0]


@cache
def session(group: str, stop_tick: int | None) -> Session:
    return Session(cell(), group, stop_tick)


def good(group: str = "kingkong", stop_tick: int | None = None) -> Log:
    """A log of its own, which a test may spoil."""
    return session(group, stop_tick).log()


@pytest.mark.parametrize("group", ["kingkong", "both"])
@pytest.mark.parametrize("stop_tick", [None, 1, 2, 300, 500, 900])
def test_a_good_log_has_no_problem(group: str, stop_tick: int | None) -> None:
    assert logcheck.problems(good(group, stop_tick)) == []


@pytest.mark.parametrize("distance", [1e-6, 1e-3, 0.1, 3.0])
def test_short_and_long_moves_are_good(distance: float) -> None:
    assert logcheck.problems(Session(cell(), "kingkong", None, distance).log()) == []


def test_the_bounds_are_tight() -> None:
    """The move takes all that V, A and J give; its differences come within a millionth of the bounds."""
    log, period = good(), cell().period
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        most = np.abs(np.diff(log.ticks["position"][:, :6], order, axis=0)).max() / period**order
        assert most == pytest.approx(getattr(cell().axes[0].limits, name), rel=1e-6)


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_a_limit_lower_by_a_part_in_a_hundred_thousand_is_exceeded(name: str) -> None:
    text = CELL.read_text()
    unit = {"velocity": "velocity_deg_s = 30", "acceleration": "acceleration_deg_s2 = 40", "jerk": "jerk_deg_s3 = 80"}
    key, value = unit[name].split(" = ")
    log = good()
    log.cell = parse_cell(text.replace(unit[name], f"{key} = {float(value) * (1 - 1e-5)}"))
    found = logcheck.limit_problems(log)
    assert found
    assert all(f"{name} by differences" in problem for problem in found)


def test_a_bump_of_a_hundredth_of_a_count_is_found() -> None:
    log = good()
    log.ticks["position"][700, 2] += 6e-8
    assert any("jerk by differences" in problem and "kingkong.3" in problem for problem in logcheck.limit_problems(log))


def test_a_missing_tick_a_double_one_and_one_off_the_grid() -> None:
    log = good()
    log.ticks = np.delete(log.ticks, 100)
    log.log_times_ns = np.delete(log.log_times_ns, 100)
    assert logcheck.tick_problems(log) == ["after tick 100 comes 102"]
    log = good()
    log.ticks["cycle_start_ns"][50] += 1
    assert logcheck.tick_problems(log) == ["tick 51 is off the grid"]
    log = good()
    log.log_times_ns[50] = log.log_times_ns[49]
    assert logcheck.tick_problems(log) == ["log times do not increase"]
    log.ticks = log.ticks[:0]
    assert logcheck.tick_problems(log) == ["no tick"]


def test_an_event_on_another_clock() -> None:
    log = good()
    log.events[0].data["now_s"] += 2.0
    assert "2.000 s from its now_s" in logcheck.time_problems(log)[0].replace("-", "")
    log = good()
    offset = int(log.metadata["axisync.clocks"]["offset_ns"])
    log.events[:] = [type(log.events[0])(log.events[0].log_time_ns + offset, log.events[0].data)]
    assert any("from the beginning of its log" in problem for problem in logcheck.time_problems(log))


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_logged_derivatives_above_their_limit(name: str) -> None:
    log = good()
    log.ticks[name][800, 0] = getattr(cell().axes[0].limits, name) * (1 + 1e-5)
    assert any(f"logged {name} is" in problem for problem in logcheck.derivative_problems(log))


@pytest.mark.parametrize(("name", "error"), [("velocity", 3e-6), ("acceleration", 3e-3)])
def test_logged_derivatives_that_are_not_those_of_the_positions(name: str, error: float) -> None:
    log = good()
    log.ticks[name][400:, 1] += error
    assert any(f"logged {name} against" in problem for problem in logcheck.derivative_problems(log))


def test_a_stop_needs_its_own_limits_and_gets_no_others() -> None:
    log = good("kingkong", 900)
    log.ticks["group_state"][log.ticks["group_state"] == GroupState.STOPPING] = GroupState.MOVING
    assert logcheck.problems(log) == []  # The falling rate shows it.
    moving = log.ticks["plan_id"][:, 0] != 0
    log.ticks["path_rate"][moving] = 1.0
    assert any("jerk" in problem for problem in logcheck.limit_problems(log))


def test_a_stop_above_its_limits() -> None:
    log = good("kingkong", 900)
    log.cell = parse_cell(CELL.read_text().replace("jerk_deg_s3 = 240", "jerk_deg_s3 = 200"))
    assert any("jerk by differences" in problem for problem in logcheck.limit_problems(log))


def test_an_axis_a_tick_late() -> None:
    log = good()
    late = log.ticks["position"][:, 4].copy()
    log.ticks["position"][1:, 4] = late[:-1]
    assert any("leave on the same tick" in problem for problem in logcheck.move_problems(log))
    assert any("kingkong.5 ends at" in problem for problem in logcheck.move_problems(log))
    assert any("kingkong.5: the setpoint moves while" in problem for problem in logcheck.rest_problems(log))


def test_an_axis_a_tick_early() -> None:
    log = good()
    early = log.ticks["position"][:, 4].copy()
    log.ticks["position"][:-1, 4] = early[1:]
    assert any("arrive on the same tick" in problem for problem in logcheck.move_problems(log))


def test_a_held_group_that_creeps() -> None:
    log = good("kingkong", 500)
    log.ticks["group_state"][-5:, 0] = GroupState.HELD
    assert logcheck.rest_problems(log) == []
    log.ticks["position"][-2:, 0] += 1e-15
    assert "kingkong.1: the setpoint moves while it should rest" in logcheck.rest_problems(log)[0]


def test_one_arm_of_two_a_tick_early() -> None:
    log = good("both")
    early = log.ticks.copy()
    for name in ("plan_id", "path_s", "path_rate", "group_state"):
        log.ticks[name][:-1, 1] = early[name][1:, 1]
    log.ticks["position"][:-1, 6:] = early["position"][1:, 6:]
    found = logcheck.move_problems(log)
    assert "plan 1: its groups do not begin and end on the same ticks" in found
    assert any("leave on the same tick" in problem for problem in found)


def test_an_end_one_bit_off() -> None:
    log = good()
    end = log.ticks["position"][-1, 3]
    log.ticks["position"][log.ticks["position"][:, 3] == end, 3] = np.nextafter(end, 10.0)
    assert any("kingkong.4 ends at" in problem for problem in logcheck.move_problems(log))


def test_targets_two_counts_off() -> None:
    log = good()
    log.ticks["target_counts"][600, 5] += 1
    assert logcheck.count_problems(log) == []
    log.ticks["target_counts"][600, 5] += 1
    assert "tick 601, kingkong.6: logged target" in logcheck.count_problems(log)[0]
    log = good()
    log.ticks["target_counts"][logcheck.moves(log)[0].span.stop - 1, 5] += 2
    assert any("ends 2 counts from its target" in problem for problem in logcheck.move_problems(log))


def test_a_stopped_move_need_not_reach_its_target_but_a_successful_one_must() -> None:
    log = good("kingkong", 500)
    assert logcheck.problems(log) == []
    log.events[0].data["details"]["status"] = "succeeded"
    assert any("ends at" in problem for problem in logcheck.move_problems(log))


def test_a_move_without_its_plan_and_one_of_other_axes() -> None:
    log = good()
    plan = log.plans.pop(1)
    assert logcheck.move_problems(log) == ["plan 1: its polynomials are not in the log"]
    log.plans[1] = {**plan, "axes": plan["axes"][:-1], "end": plan["end"][:-1]}
    assert any("planned for" in problem for problem in logcheck.move_problems(log))


def test_disabled_groups_are_not_judged_but_the_first_commanded_tick_is() -> None:
    """The setpoint follows the actual position while disabled."""
    log = good()
    rng = np.random.default_rng(3)
    log.ticks["group_state"][:10, 0] = GroupState.DISABLED
    log.ticks["position"][:10, :6] += rng.normal(size=(10, 6)) * 1e-3
    assert logcheck.limit_problems(log) == []
    log.ticks["position"][10, 0] += 1e-3
    assert logcheck.limit_problems(log)


def test_skipped_ticks_are_judged_until_there_are_too_many() -> None:
    log = good()
    row = REST_TICKS + 400
    log.ticks["skipped"][row : row + 3] = 1
    assert logcheck.problems(log) == []
    log.ticks["position"][row + 3 :, 0] += 1e-3  # It begins anew after three skipped ticks.
    assert logcheck.limit_problems(log)
    log.ticks["skipped"][row : row + 6] = 1
    assert logcheck.limit_problems(log) == []
