"""What the bench computes of logs and processes."""

import math

import numpy as np
import pytest
from processes import label
from ticklog import TickLog

from axisync_schemas.ticks import Records, TickLayout
from bench import lateness

PERIOD_NS = 2_000_000


def ticks(count: int, skipped: tuple[int, ...] = (), late_ns: int = 10_000) -> Records:
    """Ticks 1 to `count` of one axis and two groups."""
    records: Records = np.repeat(TickLayout(1, 2).new().reshape(1), count)
    records["tick"] = np.arange(1, count + 1)
    records["cycle_start_ns"] = records["tick"] * PERIOD_NS
    records["lateness_ns"] = late_ns
    for tick in skipped:
        records["skipped"][tick - 1] = 1
    return records


def test_lateness_of_executed_ticks_is_theirs() -> None:
    found = lateness(ticks(100))
    assert (found.percentile(50), found.maximum, found.total) == (10.0, 10.0, 100)


def test_a_skipped_tick_is_late_until_the_next_that_was_executed() -> None:
    records = ticks(10, skipped=(5, 6))
    records["lateness_ns"][[4, 5]] = 0
    found = lateness(records)
    assert found.total == 10
    assert found.maximum == 4010.0
    assert found.percentile(90) == 2010.0


def test_effects_are_found_in_any_group_of_the_move() -> None:
    records = ticks(10)
    records["plan_id"][2:8, 1] = 77
    records["path_s"][3:8, 1] = np.arange(1, 6) * 2e-3
    records["path_rate"][2:8, 1] = 1.0
    records["path_rate"][6:8, 1] = 0.9
    log = TickLog(records, {"move": 77, "another": 78})
    assert log.first_setpoint_ns("move") == 4 * PERIOD_NS
    assert log.first_slowed_ns("move") == 7 * PERIOD_NS
    with pytest.raises(LookupError, match="another"):
        log.first_setpoint_ns("another")


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("/v/bin/python -m axisync_service.controller --cell /run/cell.toml", "controller"),
        ("/v/bin/python -m axisync_service.recorder_process --cell x", "recorder"),
        ("/v/bin/python -m axisync_service.planner_worker", "planner"),
        ("/v/bin/python /v/bin/axisyncd demo --log-dir /tmp/axisync_service.front", "supervisor"),
        ("/v/bin/python -m axisync_service.main demo", "supervisor"),
        ("/v/bin/python -m axisync_emulator.main eod.toml", "emulator"),
        ("/v/bin/python /v/bin/axisync-emulator eod.toml --bus wukong --simcan /run/x", "emulator wukong"),
        ("/usr/bin/sleep 3", "sleep"),
    ],
)
def test_processes_are_named_by_what_they_do(command: str, name: str) -> None:
    assert label(command.split()) == name


def test_no_number_is_made_of_nothing() -> None:
    assert math.isnan(lateness(ticks(0)).maximum)


def test_spans_are_not_joined() -> None:
    """What was between two turns is no lateness."""
    later = ticks(10)
    later["cycle_start_ns"] += 60_000_000_000
    found = lateness(ticks(10, skipped=(10,)), later)
    assert (found.total, found.maximum) == (20, 10.0)
