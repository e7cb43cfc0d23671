import pytest

from axisync_client.clock import DaemonClock


def test_unknown_before_the_first_reply() -> None:
    assert DaemonClock().at(1.0) is None


def test_errs_on_the_late_side_by_the_way_there() -> None:
    clock = DaemonClock()
    clock.observe(now_s=1000.0, sent_s=10.0, received_s=10.2)
    assert clock.at(11.0) == pytest.approx(1001.0)


def test_a_slow_reply_does_not_spoil_what_is_known() -> None:
    clock = DaemonClock()
    clock.observe(1000.0, 10.0, 10.1)
    clock.observe(1005.0, 12.0, 15.05)  # answered after three seconds of work
    assert clock.at(16.0) == pytest.approx(1006.0)


def test_a_quick_reply_tightens_what_a_slow_one_said() -> None:
    clock = DaemonClock()
    clock.observe(1005.0, 12.0, 15.0)
    clock.observe(1006.0, 16.0, 16.001)
    assert clock.at(16.0) == pytest.approx(1006.0)


def test_another_machine_starts_afresh() -> None:
    clock = DaemonClock()
    clock.observe(1000.0, 10.0, 10.1)
    clock.observe(5.0, 20.0, 20.1)
    assert clock.at(20.0) == pytest.approx(5.0)
