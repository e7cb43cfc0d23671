"""Tells front and the recorder what the cycle decided: replies, events, tick records. Never waits."""

import datetime
import socket
from typing import Protocol

import numpy as np

from axisync_schemas.errors import ErrorBody
from axisync_schemas.internal import Command, ControllerEvent, ControllerReply, LogEntry
from axisync_schemas.replies import Event
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import KEPT
from axisync_schemas.topics import LOG_EVENTS
from axisync_service.motion_controller.demand import Setpoints
from axisync_service.motion_controller.step import Core
from axisync_service.motion_controller.voice import Happening

EVENTS_PER_TICK = 24
"""More than this in one tick are counted, not sent."""


class Commander(Protocol):
    """Whoever commands: front over its socket, or a plan file."""

    leases_needed: bool
    malformed: int

    @property
    def connected(self) -> bool: ...
    @property
    def finished(self) -> bool: ...
    def poll(self) -> list[Command]: ...
    def send(self, packet: bytes) -> None: ...
    def close(self) -> None: ...


class Reporter:
    """The controller's voice."""

    def __init__(self, commander: Commander, log: socket.socket | None) -> None:
        self._commander = commander
        self._log = log
        self.events_lost = 0

    def reply(self, ref: int, tick: int, error: ErrorBody | None, data: str | None = None) -> None:
        """Answers a command."""
        self._commander.send(ControllerReply(ref=ref, tick=tick, error=error, data=data).model_dump_json().encode())

    def events(self, happenings: list[Happening], tick: int, now_ns: int) -> None:
        """Sends events to front and to the log; takes them off the list."""
        self.events_lost += max(0, len(happenings) - EVENTS_PER_TICK)
        for happening in happenings[:EVENTS_PER_TICK]:
            self._event(happening, tick, now_ns)
        happenings.clear()

    def _event(self, happening: Happening, tick: int, now_ns: int) -> None:
        wall = datetime.datetime.now(datetime.UTC)
        event = Event.model_construct(
            seq=0,
            source="controller",
            kind=happening.kind.value,
            now_s=now_ns * 1e-9,
            wall_time=wall.isoformat(timespec="microseconds"),
            message=happening.message,
            tick=tick,
            group=happening.group,
            severity=happening.severity,
            details=happening.details,
        )
        self._commander.send(ControllerEvent.model_construct(event=event).model_dump_json().encode())
        self._log_entry(LogEntry(topic=LOG_EVENTS, log_time_ns=now_ns, data=event.model_dump(mode="json")))

    def _log_entry(self, entry: LogEntry) -> None:
        if self._log is None:
            return
        try:
            self._log.send(entry.model_dump_json().encode(), socket.MSG_DONTWAIT)
        except OSError:
            self.events_lost += 1


class TickWriter:
    """Fills the one record and puts it into the ring; fields are views, so nothing is allocated."""

    def __init__(self, ring: TickRing) -> None:
        self._ring = ring
        self._record = ring.layout.new()
        self._field = {name: self._record[name] for name in ring.layout.fields}
        rates = np.zeros((3, ring.layout.n_axes))
        self._rates, self._rate_bits = tuple(rates), rates.view(np.uint64)
        masks = [[KEPT[name]] for name in ("velocity", "acceleration", "jerk")]
        self._kept = np.repeat(masks, ring.layout.n_axes, axis=1)

    def write(self, tick: int, due_ns: int, lateness_ns: int, skipped: bool, setpoints: Setpoints, core: Core) -> None:
        """The record of tick `tick`, due at `due_ns`: `setpoints` are those in force at that instant."""
        field = self._field
        field["tick"][...] = tick
        field["cycle_start_ns"][...] = due_ns
        field["lateness_ns"][...] = lateness_ns
        field["skipped"][...] = skipped
        field["position"][:] = setpoints.position
        self._write_rates(setpoints)
        field["target_counts"][:] = setpoints.counts
        field["position_actual"][:] = core.watch.actual_position
        field["statusword"][:] = core.watch.statuswords
        field["plan_id"][:] = setpoints.plan_id
        field["path_s"][:] = setpoints.path_s
        field["path_rate"][:] = setpoints.path_rate
        field["group_state"][:] = setpoints.group_state
        self._ring.write(tick, self._record)

    def _write_rates(self, setpoints: Setpoints) -> None:
        """Cut in an array of their own: a record's fields are not aligned, which makes numpy slow."""
        np.bitwise_and(setpoints.rate_bits, self._kept, out=self._rate_bits)
        field = self._field
        field["velocity"][:], field["acceleration"][:], field["jerk"][:] = self._rates
