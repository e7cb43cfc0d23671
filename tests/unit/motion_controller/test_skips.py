"""Skipped ticks are reported at once, then once a second."""

from axisync_service.motion_controller.clock import Tick
from axisync_service.motion_controller.skips import SkipReport
from axisync_service.motion_controller.voice import Voice


def test_reports_are_gathered_and_nothing_is_forgotten() -> None:
    report, voice = SkipReport(500), Voice([])
    for index in range(1, 2001):
        report.add(Tick(index, 0, 0, skipped=2 if index % 10 == 0 else 0))
        if report.due(index):
            report.say(voice)
    said = [happening.details["skipped"] for happening in voice.happenings]
    assert len(said) == 4
    assert said[0] == 2
    assert sum(said) >= 2 * 150
    assert all(happening.details["most_in_a_row"] == 2 for happening in voice.happenings)


def test_nothing_skipped_nothing_said() -> None:
    report = SkipReport(500)
    report.add(Tick(7, 0, 0, skipped=0))
    assert not report.due(7)
