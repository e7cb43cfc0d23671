"""The grid clock on a clock of its own."""

from axisync_service.motion_controller.clock import GridClock


class Steps:
    """Time that wakes as late as it is told."""

    def __init__(self, late: list[int]) -> None:
        self.now, self.late = 1_000_000, late

    def now_ns(self) -> int:
        return self.now

    def wait_until_ns(self, instant_ns: int) -> None:
        if instant_ns > self.now:
            self.now = instant_ns + (self.late.pop(0) if self.late else 0)


def clock(late: list[int]) -> GridClock:
    grid = GridClock(Steps(late), 2_000_000, 1_445_000)
    grid.start()
    return grid


def test_ticks_stay_on_the_grid() -> None:
    grid = clock([100, 400_000, 0])
    ticks = [grid.wait() for _ in range(3)]
    assert [t.index for t in ticks] == [1, 2, 3]
    assert [t.lateness_ns for t in ticks] == [100, 400_000, 0]
    assert [t.due_ns for t in ticks] == [3_000_000, 5_000_000, 7_000_000]


def test_a_tick_without_room_is_skipped() -> None:
    grid = clock([0, 455_001, 0])
    assert grid.latest_ns == 455_000
    ticks = [grid.wait() for _ in range(2)]
    assert [(t.index, t.skipped) for t in ticks] == [(1, 0), (3, 1)]


def test_a_long_stall_is_never_made_up_for() -> None:
    grid = clock([0, 11_000_000, 0])
    first, after = grid.wait(), grid.wait()
    assert first.index == 1
    assert (after.index, after.skipped) == (8, 6)
    assert grid.wait().index == 9


def test_numbers_continue_after_a_restart() -> None:
    grid = GridClock(Steps([]), 2_000_000, 0)
    grid.first = 501
    grid.start()
    assert grid.wait().index == 501
