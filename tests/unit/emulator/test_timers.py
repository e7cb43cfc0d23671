"""Timers fire in the order of time."""

from axisync_emulator.timers import NEVER, Timers


def run(timers: Timers, until: int) -> None:
    while timers.next <= until:
        timers.fire()


def test_order_of_time_then_of_making():
    timers, fired = Timers(), []
    late, early, same = (timers.make(lambda now, name=name: fired.append((name, now))) for name in "les")
    late.set(30)
    same.set(20)
    early.set(20)
    run(timers, 100)
    assert fired == [("e", 20), ("s", 20), ("l", 30)]


def test_moved_later_fires_once_and_late():
    timers, fired = Timers(), []
    watchdog = timers.make(fired.append)
    for now in range(0, 1000, 10):
        watchdog.set(now + 25)
    run(timers, 990)
    assert fired == []
    run(timers, 2000)
    assert fired == [990 + 25]
    assert not watchdog.running


def test_moved_earlier_fires_early_and_once():
    timers, fired = Timers(), []
    timer = timers.make(fired.append)
    timer.set(100)
    timer.set(10)
    run(timers, 1000)
    assert fired == [10]


def test_cancelled_does_not_fire_and_can_be_set_again():
    timers, fired = Timers(), []
    timer = timers.make(fired.append)
    timer.set(10)
    timer.cancel()
    run(timers, 50)
    assert fired == []
    timer.set(60)
    run(timers, 100)
    assert fired == [60]
    assert timers.next == NEVER


def test_a_periodic_timer_keeps_its_grid():
    timers, fired = Timers(), []

    def again(now: int) -> None:
        fired.append(now)
        timer.set(now + 100)

    timer = timers.make(again)
    timer.set(100)
    run(timers, 350)
    assert fired == [100, 200, 300]
