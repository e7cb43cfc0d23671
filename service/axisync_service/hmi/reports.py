"""What is published and answered about the cell, put together from a snapshot."""

import os
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib import metadata

from axisync_robot.arm import Arm
from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import DriveState, LateCause, NmtState, RecorderState
from axisync_schemas.memory import Control, TimingRing, Word
from axisync_schemas.replies import (
    BusReport,
    CycleReport,
    DriveReport,
    GroupReport,
    Info,
    Percentiles,
    RecorderReport,
    State,
)  # fmt: skip
from axisync_service.actioner.moves import move_id_of
from axisync_service.actioner.requests import MODELS
from axisync_service.actioner.world import World
from axisync_service.links.recorder_watch import silent

Progress = Callable[[int], float | None]
"""Plan id to progress of the move, 0..1."""


def wall_time() -> str:
    """UTC, ISO 8601, to the microsecond; stamped beside monotonic times, never reckoned with."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def info(cell: Cell, log_directory: str) -> Info:
    """`info`."""
    try:
        version = metadata.version("axisync")
    except metadata.PackageNotFoundError:
        version = "unknown"
    return Info(
        name=cell.name,
        version=version,
        now_s=time.monotonic_ns() / 1e9,
        wall_time=wall_time(),
        pid=os.getpid(),
        log_directory=log_directory,
        verbs=tuple(sorted(MODELS)),
    )


class StateReports:
    """Makes `state`; keeps the arm models that poses need."""

    def __init__(self, cell: Cell, control: Control) -> None:
        self._cell = cell
        self._control = control
        self._arms = [Arm.of(group) for group in cell.groups]
        self._bus_index = {bus.name: i for i, bus in enumerate(cell.buses)}

    def state(
        self, world: World, holders: dict[str, str | None], progress: Progress, cycle: CycleReport | None, seq: int
    ) -> State:
        """The whole cell at `world.tick`."""
        return State(
            seq=seq,
            tick=world.tick,
            now_s=world.now_s,
            groups={name: self._group(i, name, world, progress) for i, name in enumerate(self._cell.group_names)},
            lease=holders,
            cycle=cycle,
            buses=self._buses(world),
            recorder=self._recorder(world.now_ns),
            controller="up" if world.up else "down",
        )

    def _group(self, index: int, name: str, world: World, progress: Progress) -> GroupReport:
        view = world.groups[index]
        axes = self._cell.axis_indices(name)
        actual = _pick(world.actual, axes)
        return GroupReport(
            state=view.state.label,
            move_id=move_id_of(view.plan_id) if view.plan_id else None,
            progress=progress(view.plan_id),
            path_rate=view.path_rate,
            position=actual,
            velocity=_pick(world.velocity, axes),
            setpoint=_pick(world.setpoint, axes),
            pose=self._pose(index, actual),
            drives=self._drives(axes, world),
            reason=view.reason,
            override=world.status.groups[index].override if world.status is not None else 1.0,
        )

    def _pose(self, index: int, actual: tuple[float, ...]) -> dict[str, tuple[float, ...]] | None:
        arm = self._arms[index]
        if arm is None or not actual:
            return None
        position, quaternion = arm.forward(actual)
        return {"position": position, "quaternion": quaternion}

    def _drives(self, axes: Sequence[int], world: World) -> tuple[DriveReport, ...]:
        if world.status is None:
            return ()
        reports = []
        for i in axes:
            axis, drive = self._cell.axes[i], world.status.drives[i]
            reports.append(
                DriveReport(
                    axis=axis.name,
                    bus=axis.drive.bus,
                    node_id=axis.drive.node_id,
                    state=DriveState(drive.state).label,
                    nmt=NmtState(drive.nmt).label,
                    statusword=drive.statusword,
                    error_code=drive.error_code,
                    error=drive.error,
                    velocity=drive.velocity,
                    torque=drive.torque,
                    temperature=drive.temperature,
                    voltage=drive.voltage,
                    safe_torque_off=drive.safe_torque_off,
                    homed=drive.homed,
                )
            )
        return tuple(reports)

    def _buses(self, world: World) -> dict[str, BusReport]:
        if world.status is None:
            return {}
        return {
            bus.name: BusReport(
                state=status.state, load=status.load, sent=status.sent, received=status.received, lost=status.lost
            )
            for bus, status in zip(self._cell.buses, world.status.buses, strict=True)
        }

    def _recorder(self, now_ns: int) -> RecorderReport:
        state = RecorderState(self._control[Word.RECORDER_STATE])
        return RecorderReport(
            state="silent" if silent(self._control, now_ns) else state.label,
            cursor_tick=self._control[Word.RECORDER_CURSOR],
            lost_ticks=self._control[Word.RECORDER_LOST],
        )


def _pick(values: tuple[float, ...], indices: Sequence[int]) -> tuple[float, ...]:
    return tuple(values[i] for i in indices) if values else ()


def cycle_report(cell: Cell, control: Control, timings: TimingRing, seq: int) -> CycleReport | None:
    """How the loop kept time over the last second; None before the first tick."""
    newest = control[Word.CONTROLLER_TICK]
    rows = timings.read(newest + 1 - round(1.0 / cell.period), newest + 1)
    if not rows:
        return None
    columns = list(zip(*rows, strict=True))
    return CycleReport(
        seq=seq,
        period_s=cell.period,
        lateness_us=_percentiles(columns[1]),
        read_us=_percentiles(columns[2]),
        decide_us=_percentiles(columns[3]),
        write_us=_percentiles(columns[4]),
        skipped_ticks=sum(columns[6]),
        realtime=control[Word.REALTIME] == 1,
        record_us=_percentiles(columns[5]),
        late_ticks=sum(cause != LateCause.NONE for cause in columns[7]),
        late_by={cause.label: columns[7].count(cause) for cause in LateCause if cause is not LateCause.NONE},
    )


def _percentiles(values: Sequence[int]) -> Percentiles:
    ordered = sorted(values)
    last = len(ordered) - 1
    return Percentiles(p50=ordered[last // 2] / 1e3, p99=ordered[last * 99 // 100] / 1e3, max=ordered[last] / 1e3)
