"""What the actioner needs from outside. `front` implements it with sockets and shared memory, tests with lists."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from axisync_schemas.events import EventKind
from axisync_schemas.internal import Command, PlanJob


@dataclass(frozen=True, slots=True)
class Answer:
    """Payload of a reply, or of a `reply_err`."""

    payload: bytes
    is_error: bool


Respond = Callable[[Answer], None]


@dataclass(frozen=True, slots=True)
class Incoming:
    """A command as it came in; `user` has been checked against the key."""

    verb: str
    user: str
    body: bytes
    respond: Respond
    received_ns: int


@dataclass(frozen=True, slots=True)
class Notice:
    """Something that happened here, to be stamped, published and logged as an `Event`."""

    kind: EventKind
    message: str
    group: str | None = None
    severity: str = "info"
    tick: int | None = None
    details: dict[str, Any] = field(default_factory=dict)


class Ports(Protocol):
    """Effects. None of them blocks or raises."""

    def to_controller(self, command: Command) -> bool:
        """Sends a command; False where the controller cannot be reached."""

    def to_planner(self, job: PlanJob) -> bool:
        """Sends a job; False where the planner cannot be reached."""

    def kill_planner(self) -> None:
        """Ends a planner that hangs; the supervisor starts another."""

    def set_lease(self, group: int, epoch: int, until_ns: int) -> None:
        """Writes a group's lease words, which the cycle compares every tick."""

    def stop_count(self, group: int) -> int:
        """How many stops the group has received."""

    def plan_duration(self, slot: int, plan_id: int) -> float | None:
        """Duration (s) of the plan in a slot, or None where the slot holds another."""

    def notice(self, notice: Notice) -> None:
        """Publishes and logs an event."""

    def log(self, topic: str, data: dict[str, Any], slot: int | None = None, plan_id: int | None = None) -> None:
        """Hands an entry to the recorder."""
