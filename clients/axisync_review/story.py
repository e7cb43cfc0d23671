"""What was asked, planned and said: the log's JSON messages, as their models."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from axisync_review.log_file import Message
from axisync_schemas.events import EventKind
from axisync_schemas.log_models import LogLine, PlanLog, RequestLog
from axisync_schemas.replies import Event
from axisync_schemas.topics import LOG_EVENTS, LOG_LINES, LOG_PLANS, LOG_REQUESTS

M = TypeVar("M", bound=BaseModel)

MODELS: dict[str, type[BaseModel]] = {
    LOG_REQUESTS: RequestLog,
    LOG_PLANS: PlanLog,
    LOG_EVENTS: Event,
    LOG_LINES: LogLine,
}


@dataclass(frozen=True, slots=True)
class Told:
    """A message and its wall time."""

    log_time_ns: int
    what: RequestLog | PlanLog | Event | LogLine


@dataclass(slots=True)
class Story:
    """All of them, each list by time.

    Attributes:
        plans: newest by plan_id; one is written again at the beginning of each file.
        lines: warnings and errors of processes.
        unread: messages that this version cannot read, by topic; others: messages of topics it does not know.
    """

    requests: list[Told] = field(default_factory=list)
    events: list[Told] = field(default_factory=list)
    lines: list[Told] = field(default_factory=list)
    plans: dict[int, PlanLog] = field(default_factory=dict)
    plan_times: dict[int, int] = field(default_factory=dict)
    unread: dict[str, int] = field(default_factory=dict)
    others: dict[str, int] = field(default_factory=dict)
    _seen: set[int] = field(default_factory=set)

    def add(self, message: Message) -> None:
        """Takes one in, once: files that overlap have it twice. Never raises."""
        model = MODELS.get(message.topic)
        if model is None:
            self.others[message.topic] = self.others.get(message.topic, 0) + 1
            return
        known = hash((message.topic, message.payload))
        if known in self._seen:
            return
        self._seen.add(known)
        try:
            what: Any = model.model_validate_json(message.payload)
        except (ValidationError, json.JSONDecodeError):
            self.unread[message.topic] = self.unread.get(message.topic, 0) + 1
            return
        if isinstance(what, PlanLog):
            self.plan_times.setdefault(what.plan_id, message.log_time_ns)
            self.plans[what.plan_id] = what
        else:
            into = {LOG_EVENTS: self.events, LOG_REQUESTS: self.requests}.get(message.topic, self.lines)
            into.append(Told(message.log_time_ns, what))

    def sort(self) -> None:
        """By time; messages of several processes do not come quite in order."""
        self.lines.sort(key=lambda told: told.log_time_ns)
        self.requests.sort(key=lambda told: told.log_time_ns)
        self.events.sort(key=lambda told: told.log_time_ns)

    def of_kind(self, *kinds: EventKind) -> Iterator[tuple[int, Event]]:
        """Events of these kinds, by time."""
        names = {kind.value for kind in kinds}
        for told in self.events:
            if isinstance(told.what, Event) and told.what.kind in names:
                yield told.log_time_ns, told.what

    def controllers(self) -> Iterator[Event]:
        """Events of the controller, by time."""
        for told in self.events:
            if isinstance(told.what, Event) and told.what.source == "controller":
                yield told.what

    def commands(self) -> Iterator[tuple[int, RequestLog]]:
        """Requests, by time."""
        for told in self.requests:
            if isinstance(told.what, RequestLog):
                yield told.log_time_ns, told.what
