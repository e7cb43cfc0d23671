"""What the daemon publishes, as the messages that the recorder writes into the log. No IO."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from axisync_client import Setpoints
from axisync_schemas.cell import Cell
from axisync_schemas.joint_states import JointStates
from axisync_schemas.log_channels import Channel, channels
from axisync_schemas.log_models import EVENT_LEVELS, line_of_event
from axisync_schemas.replies import Event, Info
from axisync_schemas.ticks import TickLayout
from axisync_schemas.topics import LOG_EVENTS, LOG_JOINT_STATES, LOG_LINES, LOG_SETPOINTS

TOPICS = frozenset({LOG_SETPOINTS, LOG_JOINT_STATES, LOG_EVENTS, LOG_LINES})
"""Those of the log's topics that can be made of what is published. Requests and plans are in the log alone."""
_SECOND_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a topic; `wall_ns` since 1970."""

    topic: str
    wall_ns: int
    payload: bytes


def live_channels() -> tuple[Channel, ...]:
    """The log's declarations of `TOPICS`."""
    return tuple(channel for channel in channels() if channel.topic in TOPICS)


def offset_ns(info: Info) -> int:
    """Wall minus monotonic time of the daemon's machine, which need not be this one."""
    return round(datetime.fromisoformat(info.wall_time).timestamp() * 1e6) * 1000 - _ns(info.now_s)


class LiveLog:
    """Makes the messages of one connection. Times are the daemon's monotonic ones plus one offset, as in a log."""

    def __init__(self, cell: Cell, offset_ns: int) -> None:
        layout = TickLayout(len(cell.axes), len(cell.groups))
        self._size = layout.size
        self._joint_states = JointStates(cell, layout)
        self._offset_ns = offset_ns

    def of_setpoints(self, batch: Setpoints) -> Iterator[Message]:
        """Every tick's record, and joint states of every so manieth."""
        records = batch.records.tobytes()
        for row, (tick, start_ns) in enumerate(zip(batch.tick.tolist(), self._starts_ns(batch), strict=True)):
            record = records[row * self._size : (row + 1) * self._size]
            wall_ns = self._wall(start_ns)
            yield Message(LOG_SETPOINTS, wall_ns, record)
            joints = self._joint_states.message(tick, record, wall_ns)
            if joints is not None:
                yield Message(LOG_JOINT_STATES, wall_ns, joints)

    def of_event(self, event: Event) -> Iterator[Message]:
        """The event; also as a line where it is a warning or an error."""
        wall_ns = self._wall(_ns(event.now_s))
        yield Message(LOG_EVENTS, wall_ns, event.model_dump_json().encode())
        if event.severity in EVENT_LEVELS:
            line = line_of_event(event.model_dump(mode="json"), wall_ns)
            yield Message(LOG_LINES, wall_ns, line.model_dump_json().encode())

    @staticmethod
    def _starts_ns(batch: Setpoints) -> list[int]:
        starts: list[int] = batch.records["cycle_start_ns"].tolist()
        return starts

    def _wall(self, monotonic_ns: int) -> int:
        return max(0, monotonic_ns + self._offset_ns)


def _ns(seconds: float) -> int:
    return round(seconds * _SECOND_NS)
