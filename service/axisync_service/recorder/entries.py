"""Log entries of the other processes: packets on the `log_*` sockets, turned into the bytes of log messages."""

import json
import mmap
import socket
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from axisync_schemas.internal import MAX_PACKET, LogEntry
from axisync_schemas.log_channels import JSON_TOPICS
from axisync_schemas.plan_slots import Plan, PlanError, codes_as_text, read_plan
from axisync_schemas.topics import LOG_EVENTS, LOG_PLANS

PACKETS_AT_ONCE = 256
"""From one socket in one call, so that a flood does not keep the recorder from the ring."""


@dataclass(frozen=True, slots=True)
class Message:
    """A JSON message for the log, at a monotonic instant; `group` is that of a plan, `event` an event's fields."""

    topic: str
    log_time_ns: int
    payload: bytes
    group: str | None = None
    event: dict[str, Any] | None = None


def message(topic: str, log_time_ns: int, data: dict[str, Any]) -> Message:
    """The message of these fields.

    Raises:
        ValueError: a number that JSON cannot hold.
    """
    payload = json.dumps(data, allow_nan=False, separators=(",", ":")).encode()
    group = str(data.get("group")) if topic == LOG_PLANS else None
    return Message(topic, log_time_ns, payload, group, data if topic == LOG_EVENTS else None)


@dataclass(slots=True)
class Received:
    """What one round over the sockets brought; `problems` are sentences for the service's own log."""

    messages: list[Message] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    more: bool = False


def plan_fields(plan: Plan) -> dict[str, Any]:
    """A plan's part of `PlanLog`; Python writes floats in the shortest form that reads back exactly."""
    return {
        "axes": plan.axes.tolist(),
        "knots": plan.knots.tolist(),
        "coefficients": plan.coefficients.tolist(),
        "start": plan.start.tolist(),
        "end": plan.end.tolist(),
        "rate_codes": codes_as_text(plan.rate_codes),
        "rate_shape": list(plan.rate_codes.shape[1:]),
        "rate_limits": plan.rate_limits.tolist(),
    }


class Entries:
    """Reads packets without waiting, and plans from their slots before these can be used again."""

    def __init__(self, sockets: Sequence[socket.socket], plans: mmap.mmap | bytearray) -> None:
        self._sockets = list(sockets)
        self._plans = plans
        for one in self._sockets:
            one.setblocking(False)

    def receive(self) -> Received:
        """Whatever has come."""
        received = Received()
        for one in list(self._sockets):
            for _ in range(PACKETS_AT_ONCE):
                packet = self._packet(one)
                if packet is None:
                    break
                self._take(packet, received)
            else:
                received.more = True
        return received

    def _packet(self, one: socket.socket) -> bytes | None:
        try:
            packet, _, flags, _ = one.recvmsg(MAX_PACKET)
        except BlockingIOError:
            return None
        except OSError:
            packet, flags = b"", 0
        if not packet:  # The other end is closed for good: the supervisor holds both as long as it lives.
            self._sockets.remove(one)
            return None
        return packet + b"..." if flags & socket.MSG_TRUNC else packet

    def _take(self, packet: bytes, received: Received) -> None:
        try:
            entry = LogEntry.model_validate_json(packet)
            if entry.topic not in JSON_TOPICS:
                raise ValueError(f"no such topic: {entry.topic!r}")
            data = self._with_plan(entry, received)
            received.messages.append(message(entry.topic, entry.log_time_ns, data))
        except ValidationError as error:
            received.problems.append(f"entry refused: {error.errors()[0]['msg']}")
        except ValueError as error:
            received.problems.append(f"entry refused: {error}")

    def _with_plan(self, entry: LogEntry, received: Received) -> dict[str, Any]:
        if entry.slot is None or entry.plan_id is None:
            return entry.data
        try:
            return {**entry.data, **plan_fields(read_plan(self._plans, entry.slot, entry.plan_id))}
        except PlanError as error:
            received.problems.append(str(error))
            return {**entry.data, "missing": str(error)}
