"""hold, resume, override and stop, end to end: judged tick by tick from the log and from the drives' frames."""

from pathlib import Path

import numpy as np
import pytest

from axisync_schemas.enumerations import GroupState
from support.cells import eod_text, small
from support.rate_runs import Order, RateRun, play_orders, problems, rate_of

TEXT = small(eod_text(), axes=1)


def end_of(played: RateRun) -> str:
    """Status of the move."""
    ended = [event.details["status"] for event in played.run.happenings if event.kind.value == "move_ended"]
    return str(ended[-1]) if ended else "never"


def play(directory: Path, *orders: Order) -> RateRun:
    played = play_orders(directory, TEXT, orders)
    assert problems(played) == []
    return played


def at_target(played: RateRun) -> bool:
    last = played.log.ticks["position"][played.moving[-1] + 1]
    return bool((last[list(played.plan.axes)] == np.array(played.plan.end)).all())


def test_hold_and_resume_at_rest_and_while_it_still_slows(tmp_path: Path) -> None:
    played = play(tmp_path, (300, "hold"), (720, "resume"), (1000, "hold"), (1050, "resume"))
    states = played.log.ticks["group_state"][:, 0]
    assert np.count_nonzero(np.diff((states == GroupState.HELD).astype(int)) == 1) == 1
    assert np.count_nonzero(np.diff((states == GroupState.STOPPING).astype(int)) == 1) == 2
    assert rate_of(played).min() == 0.0
    assert end_of(played) == "succeeded"
    assert at_target(played)


def test_a_stop_of_a_hold(tmp_path: Path) -> None:
    played = play(tmp_path, (60, "hold"), (90, "stop"))
    assert end_of(played) == "stopped"
    assert not at_target(played)


def test_an_override_down_to_nothing_and_back(tmp_path: Path) -> None:
    """Within the limits of moves all the way, and in the log tick by tick: it begins no earlier than the command."""
    played = play(tmp_path, (660, 0.3), (1400, 0.0), (1900, 1.0))
    rate = rate_of(played)
    assert (rate[:660] == 1.0).all()
    assert (rate == 0.3).any()
    assert (rate == 0.0).any()
    assert rate[-1] > rate.min()
    assert end_of(played) == "succeeded"
    assert at_target(played)
    assert "rate_relaxed" not in played.kinds()


def test_ticks_that_are_missing_are_counted_and_change_nothing(tmp_path: Path) -> None:
    """Fault 31, N at full speed and some while it slows: each skipped tick has its record, and no SYNC."""
    period = 2_000_000
    late = {850: 5 * period, 900: period, 1100: 2 * period}
    played = play_orders(tmp_path, TEXT, [(850, "hold"), (1300, "resume")], late=late)
    assert problems(played) == []
    assert np.count_nonzero(played.log.ticks["skipped"]) == 8
    said = [event for event in played.run.happenings if event.kind.value == "ticks_late"]
    assert said[0].details["worst_cause"] == "scheduler"
    assert end_of(played) == "succeeded"


def test_too_many_missing_ticks_are_a_fault_and_the_drives_stop_by_themselves(tmp_path: Path) -> None:
    """Fault 32."""
    played = play_orders(tmp_path, TEXT, [(900, "hold")], late={500: 30 * 2_000_000})
    kinds = played.kinds()
    assert kinds.count("ticks_overrun") == 2
    assert (played.log.ticks["group_state"][-1] == GroupState.FAULT).all()
    assert end_of(played) == "failed"
    assert not any(played.log.ticks["group_state"][530:, 0] == GroupState.MOVING)


@pytest.mark.parametrize("seed", range(1))
def test_random_orders(tmp_path: Path, seed: int) -> None:
    play(tmp_path, *random_orders(seed))


@pytest.mark.campaign
@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", range(1, 41))
def test_many_random_orders(tmp_path: Path, seed: int) -> None:
    played = play_orders(tmp_path, eod_text(), random_orders(seed), reach=0.8)
    assert problems(played) == []


def random_orders(seed: int) -> list[Order]:
    """At random ticks; what comes last lets the move end. A hold or a resume that comes too late is refused."""
    rng = np.random.default_rng(seed)
    at = np.cumsum(rng.integers(1, int(rng.choice([4, 60, 400])), size=12)) + int(rng.integers(0, 500))
    orders: list[Order] = []
    for tick in at.tolist():
        kind = rng.random()
        orders.append((tick, "hold" if kind < 0.2 else "resume" if kind < 0.5 else float(rng.choice([0.0, 0.4, 1.0]))))
    last = orders[-1][0] + 40
    ending: list[Order] = [(last, "stop")] if rng.random() < 0.5 else [(last, "resume"), (last, 1.0)]
    return orders + ending
