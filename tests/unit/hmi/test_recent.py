from axisync_schemas.events import EventKind
from axisync_schemas.replies import Event, Events
from axisync_service.hmi.recent import KEPT, KEPT_OF_FREQUENT, RecentEvents


def add(recent: RecentEvents, seq: int, kind: EventKind) -> None:
    event = Event(seq=seq, source="front", kind=kind, now_s=1.0, wall_time="", message="")
    recent.add(seq, kind, event.model_dump_json().encode())


def test_the_newest_are_kept_and_those_that_come_each_second_push_out_none_of_the_others() -> None:
    recent = RecentEvents()
    assert Events.model_validate_json(recent.answer(0.1 + 0.2)).now_s == 0.1 + 0.2
    add(recent, 1, EventKind.MOVE_ACCEPTED)
    for seq in range(2, 500):
        add(recent, seq, EventKind.TICKS_SKIPPED)
    add(recent, 500, EventKind.MOVE_ENDED)
    numbers = [event.seq for event in Events.model_validate_json(recent.answer(1.0)).events]
    assert numbers == [1, *range(500 - KEPT_OF_FREQUENT, 500), 500]
    for seq in range(501, 501 + KEPT):
        add(recent, seq, EventKind.MOVE_ENDED)
    assert Events.model_validate_json(recent.answer(1.0)).events[0].seq == 500 - KEPT_OF_FREQUENT
    assert len(Events.model_validate_json(recent.answer(1.0)).events) == KEPT + KEPT_OF_FREQUENT
