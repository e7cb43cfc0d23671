"""What the decisions have to say: events, answers to commands, and changes of a group's state."""

from dataclasses import dataclass, field
from typing import Any, Literal

from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.events import EventKind
from axisync_service.motion_controller.groups import GroupMachine

Severity = Literal["info", "warning", "error"]


@dataclass(slots=True)
class Happening:
    """An event as decided; the edge adds times and sends it."""

    kind: EventKind
    message: str
    group: str | None = None
    severity: Severity = "info"
    details: dict[str, Any] = field(default_factory=dict)


class Voice:
    """Collects what is to be said; the edge takes it away each tick.

    Attributes:
        happenings, replies: events, and answers to commands by `ref` (None: done).
        data: what was read for a command, hexadecimal, by `ref`.
        changed: a group changed its state in this tick.
    """

    def __init__(self, groups: list[GroupMachine]) -> None:
        self.happenings: list[Happening] = []
        self.replies: list[tuple[int, ErrorBody | None]] = []
        self.data: dict[int, str] = {}
        self.changed = True
        self._groups = groups

    def say(
        self, kind: EventKind, message: str, group: str | None, severity: Severity = "info", **details: Any
    ) -> None:
        """An event."""
        self.happenings.append(Happening(kind, message, group, severity, details))

    def enter(self, group: GroupMachine, state: GroupState) -> None:
        """Changes a group's state, and says so."""
        if group.state is state:
            return
        before, group.state, self.changed = group.state, state, True
        severity: Severity = "error" if state is GroupState.FAULT else "info"
        text = f"{group.name}: {before.label} -> {state.label}"
        details = {"before": before.label, "after": state.label, "reason": group.reason}
        self.say(EventKind.GROUP_STATE, text, group.name, severity, **details)

    def done(self, ref: int, data: str | None = None) -> None:
        """A command was carried out; `data` is what it read."""
        if data is not None:
            self.data[ref] = data
        self.replies.append((ref, None))

    def refuse(self, ref: int, code: ErrorCode, message: str, **details: Any) -> None:
        """A command is not carried out."""
        self.replies.append((ref, ErrorBody(code=code, message=message, details=details)))

    def owe(self, ref: int, groups: list[GroupMachine]) -> None:
        """Answers now where nothing is left to do, else when the last group is done."""
        if not groups:
            self.done(ref)
        for group in groups:
            group.owed.append(ref)

    def answer(
        self, group: GroupMachine, code: ErrorCode | None = None, message: str = "", only: int | None = None
    ) -> None:
        """A group is done with what it owes, or `only` with one ref; with a code it, and so the command, has failed."""
        owed = [ref for ref in group.owed if only is None or ref == only]
        group.owed = [ref for ref in group.owed if ref not in owed]
        for ref in owed:
            others = [other for other in self._groups if ref in other.owed]
            if code is not None:
                for other in others:
                    other.owed.remove(ref)
                self.refuse(ref, code, message, group=group.name)
            elif not others:
                self.done(ref)
