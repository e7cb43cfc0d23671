"""Warnings and errors on their way to the log."""

import json
import logging
import socket
from collections.abc import Iterator

import pytest

from axisync_schemas.internal import LogEntry
from axisync_schemas.log_models import LogLevel, LogLine
from axisync_service.log_lines import LineHandler, LineSender, Quota

SECOND = 10**9


@pytest.fixture
def logger() -> Iterator[logging.Logger]:
    """One that tells nobody else."""
    one = logging.Logger("test", logging.DEBUG)
    yield one
    for handler in one.handlers:
        handler.close()


def test_warnings_and_errors_go_with_their_place_and_the_rest_stays(logger: logging.Logger) -> None:
    got: list[LogLine] = []
    logger.addHandler(LineHandler("front", lambda line, _: got.append(line)))
    logger.info("quiet")
    logger.warning("link=%s full", "planner")
    try:
        raise ValueError("broken")
    except ValueError:
        logger.exception("step failed")
    assert [(line.level, line.message) for line in got] == [
        (LogLevel.WARNING, "link=planner full"),
        (LogLevel.ERROR, "step failed error=ValueError('broken')"),
    ]
    assert (got[0].name, got[0].file) == ("front", "test_log_lines.py")
    assert got[0].line > 0


def test_a_quota_counts_what_it_leaves_out() -> None:
    quota = Quota(3)
    assert [quota.take(SECOND + n) for n in range(5)] == [0, 0, 0, None, None]
    assert [quota.take(2 * SECOND), quota.take(2 * SECOND)] == [2, 0]


def test_lines_cross_as_entries_and_a_full_socket_never_waits(logger: logging.Logger) -> None:
    writer, reader = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with writer, reader:
        handler = LineSender("planner", writer.fileno(), lambda: 42)
        logger.addHandler(handler)
        logger.error("job=malformed")
        entry = LogEntry.model_validate_json(reader.recv(65536))
        assert (entry.topic, entry.log_time_ns) == ("/log", 42)
        line = LogLine.model_validate_json(json.dumps(entry.data))
        assert line.message == "job=malformed"
        handler._quota = Quota(10**6)
        for _ in range(2000):  # Far more than the socket holds; nobody reads.
            logger.error("x" * 1000)


def test_a_message_that_cannot_be_made_is_lost_not_raised(
    logger: logging.Logger, capsys: pytest.CaptureFixture[str]
) -> None:
    logger.addHandler(LineHandler("front", lambda line, _: None))
    logger.error("%d", "no number")
    assert "log line lost" in capsys.readouterr().err
