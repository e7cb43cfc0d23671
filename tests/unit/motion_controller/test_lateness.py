"""Late ticks are counted by cause, and the report names the worst."""

import pytest

from axisync_schemas.enumerations import LateCause
from axisync_service.motion_controller.clock import Tick
from axisync_service.motion_controller.lateness import BUDGET, REPORT_S, Lateness, Spent
from axisync_service.motion_controller.voice import Voice

PERIOD = 2_000_000
QUICK = dict.fromkeys(BUDGET, 100000)


def tick(late_ns: int, skipped: int = 0, index: int = 10) -> Tick:
    return Tick(index, 0, late_ns, skipped)


def spent(preempted: bool = False, **stages: int) -> Spent:
    return Spent(**(QUICK | stages), preempted=preempted)


def test_in_time_is_nobodys_fault() -> None:
    lateness = Lateness(PERIOD)
    assert lateness.judge(tick(100_000)) is LateCause.NONE
    assert not lateness.due(10)


@pytest.mark.parametrize(
    ("before", "cause", "stage"),
    [
        (spent(), LateCause.SCHEDULER, None),
        (spent(decide=2_500_000), LateCause.OWN_CODE, "decide"),
        (spent(record=2_500_000), LateCause.OWN_CODE, "record"),
        (spent(read=2_500_000), LateCause.BUS, "read"),
        (spent(write=2_500_000), LateCause.BUS, "write"),
        (spent(preempted=True, decide=2_500_000), LateCause.SCHEDULER, "decide"),
    ],
)
def test_the_cycle_before_names_the_cause(before: Spent, cause: LateCause, stage: str | None) -> None:
    lateness, voice = Lateness(PERIOD), Voice([])
    lateness.note(before)
    assert lateness.judge(tick(900_000)) is cause
    lateness.say(10, voice)
    (said,) = voice.happenings
    assert said.details["worst_cause"] == cause.label
    assert said.details["worst_stage"] == stage
    assert said.details["causes"][cause.label] == said.details["late"] == 1


def test_a_skipped_tick_is_late_even_if_the_next_is_not() -> None:
    lateness = Lateness(PERIOD)
    assert lateness.judge(tick(0, skipped=1)) is LateCause.SCHEDULER


def test_reports_are_seldom_and_forget_nothing() -> None:
    lateness, voice = Lateness(PERIOD), Voice([])
    ticks = round(3.5 * REPORT_S * 1e9 / PERIOD)
    for index in range(ticks):
        lateness.judge(tick(200_000 + index, index=index))
        if lateness.due(index):
            lateness.say(index, voice)
    said = [happening.details["late"] for happening in voice.happenings]
    assert said[0] == 1
    assert len(said) == 4
    assert sum(said) > 3 * REPORT_S * 1e9 / PERIOD
    assert max(happening.details["worst_us"] for happening in voice.happenings) < 200 + ticks / 1e3
