import threading
import time

import pytest

from axisync_client import AxisyncError, InvalidArgument, Refused, TimedOut, Unavailable
from axisync_client.renewal import Renewal, is_final
from axisync_schemas.errors import ErrorBody, ErrorCode

TTL_S = 0.15


def refused(code: ErrorCode) -> Refused:
    return Refused(ErrorBody(code=code, message="no"))


@pytest.mark.parametrize(
    ("error", "final"),
    [
        (refused(ErrorCode.LEASE_FENCED), True),
        (refused(ErrorCode.LEASE_REQUIRED), True),
        (refused(ErrorCode.NOT_AUTHORISED), True),
        (InvalidArgument("no"), True),
        (refused(ErrorCode.RATE_LIMITED), False),
        (refused(ErrorCode.UNAVAILABLE), False),
        (Unavailable("gone"), False),
        (TimedOut("late"), False),
    ],
)
def test_which_errors_end_a_lease_at_once(error: AxisyncError, final: bool) -> None:
    assert is_final(error) is final


class Daemon:
    """Answers renewals by a list of what to do; afterwards well."""

    def __init__(self, *errors: AxisyncError) -> None:
        self.errors = list(errors)
        self.times: list[float] = []
        self.losses: list[AxisyncError] = []
        self.lost = threading.Event()

    def renew(self, timeout_s: float) -> float:
        self.times.append(time.monotonic())
        if self.errors:
            raise self.errors.pop(0)
        return time.monotonic() + TTL_S

    def lose(self, error: AxisyncError) -> None:
        self.losses.append(error)
        self.lost.set()

    def start(self) -> Renewal:
        return Renewal(TTL_S, time.monotonic() + TTL_S, self.renew, self.lose)


def test_goes_on_until_stopped() -> None:
    daemon = Daemon()
    renewal = daemon.start()
    assert not daemon.lost.wait(4 * TTL_S)
    renewal.stop()
    assert len(daemon.times) >= 4
    count = len(daemon.times)
    assert not daemon.lost.wait(TTL_S)
    assert len(daemon.times) <= count + 1


def test_a_passing_error_is_tried_again_before_the_lease_lapses() -> None:
    daemon = Daemon(Unavailable("gone"))
    renewal = daemon.start()
    assert not daemon.lost.wait(2 * TTL_S)
    renewal.stop()
    assert len(daemon.times) >= 3


def test_a_final_error_ends_it_at_once() -> None:
    daemon = Daemon(refused(ErrorCode.LEASE_FENCED))
    daemon.start()
    assert daemon.lost.wait(5.0)
    assert len(daemon.times) == 1
    assert [error.code for error in daemon.losses] == ["LEASE_FENCED"]


def test_silence_ends_it_when_the_lease_lapses() -> None:
    daemon = Daemon(*[Unavailable("gone")] * 1000)
    begin = time.monotonic()
    daemon.start()
    assert daemon.lost.wait(5.0)
    assert time.monotonic() - begin >= TTL_S
    assert len(daemon.losses) == 1
