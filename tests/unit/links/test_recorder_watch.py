"""What clients hear of the recorder."""

from axisync_schemas.internal import RecorderStatus
from axisync_schemas.memory import RECORDER_BYTES, Control, Mailbox, Word
from axisync_schemas.replies import Event
from axisync_service.actioner.ports import Notice
from axisync_service.links.recorder_watch import SILENT_NS, RecorderWatch

NOW = 10**12


class Rig:
    """Both sides of the mailbox."""

    def __init__(self) -> None:
        self.control = Control(bytearray(Control.size(1)), 1)
        self.mailbox = Mailbox(bytearray(RECORDER_BYTES))
        self.published: list[Event] = []
        self.notices: list[Notice] = []
        self.watch = RecorderWatch(self.control, self.mailbox, self.published.append, self.notices.append, NOW)
        self.control[Word.RECORDER_NS] = NOW

    def say(self, *instants_s: float) -> None:
        events = tuple(
            Event(seq=0, source="recorder", kind="log_opened", now_s=now_s, wall_time="", message=str(now_s))
            for now_s in instants_s
        )
        self.mailbox.write(RecorderStatus(file=None, events=events).model_dump_json().encode())


def test_each_event_is_published_once_and_none_from_before() -> None:
    rig = Rig()
    rig.watch.look(NOW)
    rig.say(999.0, 1000.5, 1001.0)
    rig.watch.look(NOW + 1)
    rig.watch.look(NOW + 2)
    rig.say(1000.5, 1001.0, 1002.0)
    rig.watch.look(NOW + 3)
    assert [event.now_s for event in rig.published] == [1000.5, 1001.0, 1002.0]
    assert rig.notices == []


def test_silence_is_told_once_and_so_is_its_end() -> None:
    rig = Rig()
    for late_ns in (SILENT_NS, SILENT_NS + 1, 2 * SILENT_NS):
        rig.watch.look(NOW + late_ns)
    rig.control[Word.RECORDER_NS] = NOW + 3 * SILENT_NS
    rig.watch.look(NOW + 3 * SILENT_NS)
    rig.watch.look(NOW + 3 * SILENT_NS + 1)
    assert [(str(notice.kind), notice.severity) for notice in rig.notices] == [
        ("recorder_failing", "error"),
        ("recorder_recovered", "info"),
    ]
    assert "2.0 s" in rig.notices[0].message


def test_a_recorder_that_has_not_begun_is_not_silent() -> None:
    rig = Rig()
    rig.control[Word.RECORDER_NS] = 0
    rig.watch.look(NOW + 10 * SILENT_NS)
    assert rig.notices == []
