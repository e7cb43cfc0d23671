"""A log of any length as the service would write it, by the recorder's own writer: all axes move, back and forth."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisync_motion import Trajectory, from_profiles, synchronise
from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import Records, TickLayout, shorten_rates
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.log_file import LogFile

CLOCKS = ClockPair(monotonic_ns=5_000_000_000, wall_ns=1_700_000_000_000_000_000)
STATUSWORD = 0x1637
"""Operation enabled, target reached, cyclic synchronous position."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A move of all axes, and the records of its ticks; the last one is at rest."""

    trajectory: Trajectory
    records: Records


def write(directory: Path, cell_file: Path, ticks: int, seed: int = 1) -> Path:
    """A log of at least `ticks` ticks that keeps every limit; its path."""
    cell, text = read_cell(cell_file)
    log = LogFile(directory, cell, text, CLOCKS)
    legs = _legs(cell)
    rng = np.random.default_rng(seed)
    done = number = 0
    while done < ticks:
        number += 1
        leg = legs[number % 2]
        records = _placed(cell, leg.records, done + 1, number, rng)
        _tell(log, cell, leg, number, done)
        for record, at in zip(records, records["cycle_start_ns"].tolist(), strict=True):
            done += 1
            log.add_tick(record.tobytes(), done, at)
    log.finish()
    return log.path


def _legs(cell: Cell) -> tuple[Leg, Leg]:
    start = np.array([axis.drive.start for axis in cell.axes])
    towards = np.where(start > 0.0, -1.0, 1.0)  # away from the hard limits
    target = start + towards * 0.9 / (1.0 + 0.1 * np.arange(len(start)))
    return _leg(cell, target, start), _leg(cell, start, target)


def _leg(cell: Cell, start: NDArray[np.float64], target: NDArray[np.float64]) -> Leg:
    limits = [axis.limits for axis in cell.axes]
    profile = synchronise(
        target - start, [x.velocity for x in limits], [x.acceleration for x in limits], [x.jerk for x in limits]
    )
    trajectory = from_profiles(start, profile, target)
    layout = TickLayout(len(cell.axes), len(cell.groups))
    s = np.arange(1, int(trajectory.duration / cell.period) + 2) * cell.period
    records = np.repeat(layout.new()[np.newaxis], len(s))
    for name, values in zip(("position", "velocity", "acceleration", "jerk"), trajectory.sample(s), strict=True):
        records[name] = values
    shorten_rates(records)
    records["target_counts"] = np.rint(records["position"] * [axis.drive.counts_per_rad for axis in cell.axes])
    records["position_actual"][0], records["position_actual"][1:] = start, records["position"][:-1]
    records["statusword"] = STATUSWORD
    records["group_state"], records["path_rate"] = GroupState.MOVING, 1.0
    records["path_s"] = s[:, np.newaxis]
    records["group_state"][-1], records["path_rate"][-1], records["path_s"][-1] = GroupState.STANDSTILL, 0.0, 0.0
    return Leg(trajectory, records)


def _placed(cell: Cell, records: Records, first: int, plan_id: int, rng: np.random.Generator) -> Records:
    placed: Records = records.copy()
    placed["tick"] = np.arange(first, first + len(records))
    placed["cycle_start_ns"] = CLOCKS.monotonic_ns + placed["tick"] * np.uint64(cell.period_ns)
    placed["lateness_ns"] = rng.lognormal(8.0, 0.8, len(records))
    placed["plan_id"][:-1] = plan_id
    return placed


def _tell(log: LogFile, cell: Cell, leg: Leg, number: int, tick: int) -> None:
    """The plan and its events."""
    now = CLOCKS.monotonic_ns + tick * cell.period_ns
    for topic, data, at in _messages(leg, number, tick, now, now + len(leg.records) * cell.period_ns):
        log.add_json(topic, at, json.dumps(data, separators=(",", ":")).encode())


def _messages(leg: Leg, number: int, tick: int, now: int, end: int) -> Iterator[tuple[str, dict[str, Any], int]]:
    path = leg.trajectory
    move_id = f"m-{number}"
    yield "/plans", {
        "plan_id": number, "move_id": move_id, "group": "both", "user": "bench", "move": {"kind": "joint"},
        "axes": list(range(path.start.size)), "knots": path.knots.tolist(),
        "coefficients": path.coefficients.tolist(), "start": path.start.tolist(), "end": path.end.tolist(),
    }, now  # fmt: skip
    for kind, text, at, details in (
        ("move_started", f"move {number} of both starts", now, {}),
        ("move_ended", f"move {number} of both succeeded", end, {"status": "succeeded", "reason": None}),
    ):
        yield "/events", {
            "source": "controller", "kind": kind, "now_s": at / 1e9, "wall_time": "", "message": text, "tick": tick,
            "group": "both", "details": {"plan_id": number, **details},
        }, at  # fmt: skip
