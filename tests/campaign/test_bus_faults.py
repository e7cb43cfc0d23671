"""Faults of buses and drives with all twelve axes and many seeds, in lock-step: see `support.bus_faults`."""

from pathlib import Path

import pytest

from support.bus_faults import (
    FOREIGN,
    FOREIGN_SYNC,
    LATCHED,
    TOLERATED,
    Setup,
    goes_on,
    keeps_limits,
    play_with,
    stops_and_latches,
    stops_on_its_path,
    wrapping,
)
from support.cells import eod_text

SEEDS = range(20)
TWELVE = Setup(eod_text(), range(360, 560))
pytestmark = [pytest.mark.campaign, pytest.mark.timeout(300)]
every_seed = pytest.mark.parametrize("seed", SEEDS)


@every_seed
@pytest.mark.parametrize("name", TOLERATED)
def test_tolerated(tmp_path: Path, name: str, seed: int) -> None:
    goes_on(play_with(tmp_path, TWELVE, [TOLERATED[name]], seed))


@every_seed
def test_positions_wrap(tmp_path: Path, seed: int) -> None:
    setup = Setup(wrapping(TWELVE.text), TWELVE.under_way)
    goes_on(play_with(tmp_path, setup, [TOLERATED["up_to_N_RPDOs_lost"]], seed))


@every_seed
@pytest.mark.parametrize("name", LATCHED)
def test_stops_the_group_and_nobody_else_jerks(tmp_path: Path, name: str, seed: int) -> None:
    stops_and_latches(play_with(tmp_path, TWELVE, [LATCHED[name].make], seed), LATCHED[name])


@every_seed
@pytest.mark.parametrize("name", FOREIGN)
def test_frames_of_others_stop_the_arms_on_their_path(tmp_path: Path, name: str, seed: int) -> None:
    stops_on_its_path(play_with(tmp_path, TWELVE, [FOREIGN[name].make], seed), FOREIGN[name])


@every_seed
def test_a_foreign_SYNC_is_noticed(tmp_path: Path, seed: int) -> None:
    played = play_with(tmp_path, TWELVE, [FOREIGN_SYNC.make], seed)
    assert played.run.failure is not None
    assert "foreign_frames" in [event.kind.value for event in played.run.happenings]
    keeps_limits(played, [i for i in range(12) if i >= 6], "stop_limits")
