"""Frames of others on a bus: which of them are noticed, and when."""

import pytest

from axisync_schemas.cell import parse_cell
from axisync_service.motion_controller.foreign import BABBLE, QUIET_S, Foreign
from axisync_service.motion_controller.step import Core
from support.cells import eod_text

CELL = parse_cell(eod_text())
QUIET_TICKS = round(QUIET_S / CELL.period)


@pytest.fixture
def foreign() -> Foreign:
    def no_plan(_slot: int, _plan_id: int) -> None:
        raise AssertionError

    return Foreign(CELL, Core(CELL, no_plan).groups)  # type: ignore[arg-type]


@pytest.mark.parametrize("can_id", [0x000, 0x080, 0x201, 0x306, 0x403, 0x502, 0x601, 0x77F])
def test_one_frame_that_only_we_may_send_is_enough(foreign: Foreign, can_id: int) -> None:
    foreign.hear(1, can_id)
    (notice,) = foreign.notice(10)
    assert notice.bus == "wukong"
    assert f"0x{can_id:03X}" in notice.why
    assert [group.name for group in notice.groups] == ["wukong"]
    assert foreign.notice(11) == []


@pytest.mark.parametrize("can_id", [0x081, 0x381, 0x486])
def test_what_our_drives_may_send_besides_is_none(foreign: Foreign, can_id: int) -> None:
    for tick in range(50):
        for _ in range(5):
            foreign.hear(0, can_id)
        assert foreign.notice(tick) == []


def test_a_babbling_node_is_noticed_within_10_ms(foreign: Foreign) -> None:
    for tick in range(100):
        foreign.hear(0, 0x123)
        foreign.hear(0, 0x123)
        if foreign.notice(tick):
            break
    assert tick + 1 == BABBLE
    assert (tick + 1) * CELL.period <= 0.010


def test_another_device_that_speaks_now_and_then_is_none(foreign: Foreign) -> None:
    for tick in range(1000):
        foreign.hear(0, 0x17B)
        assert foreign.notice(tick) == []


def test_it_is_news_once_until_it_was_quiet(foreign: Foreign) -> None:
    news = []
    for tick in (1, 2, 3, 3 + QUIET_TICKS, 4 + 2 * QUIET_TICKS):
        foreign.hear(0, 0x080)
        news += [notice.news for notice in foreign.notice(tick)]
    assert news == [True, False, False, False, True]
