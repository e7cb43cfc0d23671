"""Snapshots of the robot from shared memory: the newest tick record and the controller's status."""

import numpy as np
from pydantic import ValidationError

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState, Phase, RecorderState
from axisync_schemas.internal import CONTROLLER_STATUS, ControllerStatus, GroupStatus
from axisync_schemas.memory import Control, Mailbox, Word
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import Records
from axisync_service.actioner.world import GroupView, World

STALE_NS = 250_000_000
"""A controller that has not finished a cycle for this long is down: its drives have stopped by themselves."""
VELOCITY_TICKS = 8
"""The measured velocity is a difference over this many ticks."""

_DOWN = GroupView(GroupState.DISABLED, 0, 0.0, 0.0, -1, "the controller is down")


class WorldReader:
    """Reads what the controller writes; reading never disturbs it."""

    def __init__(self, cell: Cell, control: Control, ring: TickRing, status: Mailbox) -> None:
        self._cell = cell
        self._control = control
        self._ring = ring
        self._status = status
        self._status_bytes = b""
        self._parsed: ControllerStatus | None = None
        self._record: Records | None = None
        self._tick = 0

    def read(self, now_ns: int, phase: Phase, linked_since_ns: int | None) -> World:
        """The robot now. `linked_since_ns`: since when front is connected to the controller, None while it is not."""
        up = linked_since_ns is not None and now_ns - self._control[Word.CONTROLLER_NS] < STALE_NS
        status = self._read_status() if up else None
        if status is None or linked_since_ns is None or status.now_ns < linked_since_ns:
            up, status = False, None  # The status of an earlier controller says nothing.
        record = self._newest()
        setpoint, actual, velocity = self._axes(record)
        groups = self._groups(record, status) if up else (_DOWN,) * len(self._cell.groups)
        unlogged = self._control[Word.RECORDER_STATE] == RecorderState.FAILING
        return World(now_ns, phase, up, self._tick, setpoint, actual, velocity, groups, status, unlogged)

    def _read_status(self) -> ControllerStatus | None:
        data = self._status.read()
        if data is not None and data != self._status_bytes:
            try:
                self._parsed = CONTROLLER_STATUS.validate_json(data)
            except ValidationError:
                self._parsed = None
            self._status_bytes = data
        return self._parsed

    def _newest(self) -> Records | None:
        """The newest record that can be read whole."""
        newest = self._control[Word.CONTROLLER_TICK]
        if newest != self._tick:
            for tick in (newest, newest - 1):
                data = self._ring.read(tick)
                if data is not None:
                    self._record, self._tick = self._decode(data), tick
                    break
        return self._record

    def _decode(self, data: bytes) -> Records:
        """The ring has verified it already."""
        record: Records = np.frombuffer(data, dtype=self._ring.layout.dtype)[0]
        return record

    def _axes(self, record: Records | None) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        if record is None:
            return (), (), ()
        actual = record["position_actual"]
        before = self._ring.read(self._tick - VELOCITY_TICKS)
        if before is None:
            velocity = actual * 0.0
        else:
            then = self._decode(before)["position_actual"]
            velocity = (actual - then) / (VELOCITY_TICKS * self._cell.period)
        return tuple(record["position"].tolist()), tuple(actual.tolist()), tuple(velocity.tolist())

    def _groups(self, record: Records | None, status: ControllerStatus | None) -> tuple[GroupView, ...]:
        if record is None or status is None:
            return (_DOWN,) * len(self._cell.groups)
        return tuple(
            GroupView(
                state=GroupState(state),
                plan_id=plan_id,
                path_s=path_s,
                path_rate=rate,
                slot=report.slot,
                reason=_reason(report, state),
            )
            for state, plan_id, path_s, rate, report in zip(
                record["group_state"].tolist(),
                record["plan_id"].tolist(),
                record["path_s"].tolist(),
                record["path_rate"].tolist(),
                status.groups,
                strict=True,
            )
        )


def _reason(report: GroupStatus, state: int) -> str | None:
    """The status is up to 50 ms older than the record: its reason counts only where both mean one state."""
    return report.reason if report.state == state else None
