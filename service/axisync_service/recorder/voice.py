"""What the recorder says of itself: as events for the log, and for front, which publishes them."""

from collections import deque
from typing import Literal

from axisync_schemas.events import EventKind
from axisync_schemas.internal import RecorderStatus
from axisync_schemas.log_models import EVENT_LEVELS, LogLine, line_of_event
from axisync_schemas.memory import Mailbox
from axisync_schemas.replies import Event
from axisync_schemas.topics import LOG_EVENTS, LOG_LINES
from axisync_service.log_lines import Quota
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.entries import Message, message

Severity = Literal["info", "warning", "error"]
KEPT = 8
"""Events that front can still see; it looks fifty times a second."""


class Voice:
    """Makes events, and keeps the newest in the mailbox."""

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox
        self._events: deque[Event] = deque(maxlen=KEPT)

    def event(
        self,
        now_ns: int,
        clocks: ClockPair,
        file: str | None,
        kind: EventKind,
        text: str,
        severity: Severity,
        details: dict[str, object],
    ) -> Message:
        """The event as a message for the log; front has it from here on."""
        event = Event(
            source="recorder",
            kind=kind.value,
            now_s=now_ns / 1e9,
            wall_time=clocks.iso(now_ns),
            message=text,
            severity=severity,
            details=details,
        )
        self._events.append(event)
        self._mailbox.write(RecorderStatus(file=file, events=tuple(self._events)).model_dump_json().encode())
        return message(LOG_EVENTS, now_ns, event.model_dump(mode="json"))


class Lines:
    """`/log` lines of other processes' warnings and errors that come as events: the cycle writes no lines itself."""

    def __init__(self) -> None:
        self._quota = Quota()

    def of(self, event: Message, clocks: ClockPair) -> Message | None:
        """The line of an event, where it has one."""
        data = event.event or {}
        if str(data.get("severity")) not in EVENT_LEVELS:
            return None
        left_out = self._quota.take(event.log_time_ns)
        if left_out is None:
            return None
        return line_message(line_of_event(data, clocks.wall(event.log_time_ns), left_out), event.log_time_ns)


def line_message(line: LogLine, log_time_ns: int) -> Message:
    """A line as a message for the log."""
    return message(LOG_LINES, log_time_ns, line.model_dump(mode="json"))
