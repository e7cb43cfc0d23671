"""What Zenoh's threads hand to the actor."""

from dataclasses import dataclass

from axisync_schemas.errors import ErrorBody
from axisync_service.actioner.ports import Incoming, Respond


@dataclass(frozen=True, slots=True)
class Ask:
    """A query about the cell: `state`, `info`, `events`, or `moves` with the id in `rest`."""

    name: str
    rest: str
    respond: Respond


@dataclass(frozen=True, slots=True)
class Done:
    """A command that was answered in its callback thread, to be logged: a stop, or one turned away at the door."""

    verb: str
    user: str
    body: bytes
    reply: bytes | None
    error: ErrorBody | None
    received_ns: int
    answered_ns: int


Item = Incoming | Ask | Done
