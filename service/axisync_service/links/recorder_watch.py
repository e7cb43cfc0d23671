"""What front tells clients of the log: the recorder's own events, and that it says nothing any more."""

from collections.abc import Callable

from pydantic import ValidationError

from axisync_schemas.events import EventKind
from axisync_schemas.internal import RecorderStatus
from axisync_schemas.memory import Control, Mailbox, Word
from axisync_schemas.replies import Event
from axisync_service.actioner.ports import Notice

SILENT_NS = 2_000_000_000
"""A recorder without a sign of life for this long is dead, or waits for its disk; the ring holds the ticks for 10 s."""


def silent(control: Control, now_ns: int) -> bool:
    """The recorder has begun, and has not been heard of since."""
    heard_ns = control[Word.RECORDER_NS]
    return heard_ns > 0 and now_ns - heard_ns > SILENT_NS


class RecorderWatch:
    """Publishes the recorder's events, which the log has already; its silence is an event of front's own."""

    def __init__(
        self,
        control: Control,
        mailbox: Mailbox,
        publish: Callable[[Event], None],
        notice: Callable[[Notice], None],
        now_ns: int,
    ) -> None:
        """Events before `now_ns` are not told again."""
        self._control, self._mailbox = control, mailbox
        self._publish, self._notice = publish, notice
        self._told_s = now_ns / 1e9
        self._bytes: bytes | None = None
        self._silent = False

    def look(self, now_ns: int) -> None:
        """To be called some times a second."""
        self._forward()
        if silent(self._control, now_ns) is not self._silent:
            self._silent = not self._silent
            self._notice(_silence(now_ns - self._control[Word.RECORDER_NS]) if self._silent else _back())

    def _forward(self) -> None:
        payload = self._mailbox.read(attempts=2)
        if payload is None or payload == self._bytes:
            return
        self._bytes = payload
        try:
            events = RecorderStatus.model_validate_json(payload).events
        except ValidationError:
            return
        for event in events:
            if event.now_s > self._told_s:
                self._told_s = event.now_s
                self._publish(event)


def _silence(for_ns: int) -> Notice:
    text = f"the recorder has not been heard of for {for_ns / 1e9:.1f} s: it is dead, or its disk does not answer"
    return Notice(EventKind.RECORDER_FAILING, text, severity="error", details={"reason": "silent"})


def _back() -> Notice:
    return Notice(EventKind.RECORDER_RECOVERED, "the recorder is heard of again", details={"reason": "silent"})
