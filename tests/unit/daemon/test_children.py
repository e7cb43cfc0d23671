"""Restarts are bounded; exit codes are said in words."""

from axisync_service.daemon.children import RESTARTS_MAX, Restarts, describe_exit


def test_five_restarts_in_a_minute_and_no_more() -> None:
    restarts = Restarts()
    assert [restarts.allowed(float(i)) for i in range(RESTARTS_MAX + 1)] == [True] * RESTARTS_MAX + [False]


def test_old_restarts_are_forgotten() -> None:
    restarts = Restarts()
    for i in range(20):
        assert restarts.allowed(i * 15.0)


def test_exit_in_words() -> None:
    assert describe_exit(-9) == "killed by SIGKILL"
    assert describe_exit(3) == "ended with exit code 3"
