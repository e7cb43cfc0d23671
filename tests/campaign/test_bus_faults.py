"""Faults of buses and drives while both arms move, in lock-step: what is tolerated, what stops whom, and how smoothly.

Judged by what the drives received and sent (the candump of the emulator) and by the log's float64 positions.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.log_models import PlanLog
from axisync_schemas.ticks import Records
from axisync_service.mapper.counts import CountMap
from support.daemon import eod_text
from support.lock_step import Run, as_log, emulated, play
from support.plans import joint_plan

SEEDS = range(20)
KINGKONG = 0
UNDER_WAY = range(550, 800)
"""SYNCs in which the move of both arms is at work."""

Fault = dict[str, object]
Make = Callable[[np.random.Generator, int], Fault]


TOLERATED: dict[str, Make] = {
    "up_to_N_RPDOs_lost": lambda rng, n: {"kind": "lose", "id": 0x200 + n, "count": int(rng.integers(1, 6))},
    "a_SYNC_lost": lambda rng, n: {"kind": "lose", "id": 0x080, "count": int(rng.integers(1, 3))},
    "RPDOs_twice": lambda rng, n: {"kind": "duplicate", "id": 0x200, "mask": 0x780, "probability": 0.2},
    "SYNC_twice": lambda rng, n: {"kind": "duplicate", "id": 0x080, "probability": 0.2},
    "out_of_order": lambda rng, n: {"kind": "delay", "id": 0x200 + n, "delay_s": 0.0003, "probability": 0.3},
    "error_frames": lambda rng, n: {"kind": "corrupt", "probability": 0.003},
    "two_TPDOs_missing": lambda rng, n: {"kind": "mute", "node": n, "id": 0x180 + n, "syncs": 2},
    "clock_500_ppm_off": lambda rng, n: {"kind": "drift", "node": n, "ppm": float(rng.uniform(-500, 500))},
    "warm": lambda rng, n: {"kind": "temperature", "node": n, "celsius": 85.0, "per_s": 100.0},
}
STOPPING: dict[str, Make] = {
    "more_than_N_RPDOs_lost": lambda rng, n: {"kind": "lose", "id": 0x200 + n, "count": int(rng.integers(7, 30))},
    "SYNC_lost_for_good": lambda rng, n: {"kind": "lose", "id": 0x080},
    "bit_flip_in_a_target": lambda rng, n: {
        "kind": "flip", "id": 0x200 + n, "bit": int(rng.integers(16 + 12, 48)), "count": 1,
    },
    "bus-off_of_the_controller": lambda rng, n: {"kind": "bus_off", "duration_s": 0.5},
    "bus-off_of_a_drive": lambda rng, n: {"kind": "bus_off", "node": n, "duration_s": 0.5},
    "foreign_NMT": lambda rng, n: {"kind": "babble", "id": 0, "data": "8000", "duration_s": 0.02},
    "emergency": lambda rng, n: {"kind": "emergency", "node": n, "code": int(rng.choice([0x2310, 0x7305, 0x5112]))},
    "heartbeat_lost": lambda rng, n: {"kind": "no_heartbeat", "node": n},
    "jammed": lambda rng, n: {"kind": "jam", "node": n},
    "TPDOs_missing": lambda rng, n: {"kind": "mute", "node": n, "id": 0x180 + n, "syncs": 10},
    "frozen_actuals": lambda rng, n: {"kind": "freeze", "node": n},
    "reset": lambda rng, n: {"kind": "reset", "node": n},
    "power_cycle": lambda rng, n: {"kind": "power_cycle", "node": n, "duration_s": 0.3},
    "leaves_csp": lambda rng, n: {"kind": "leave_mode", "node": n},
    "safe_torque_off": lambda rng, n: {"kind": "sto", "node": n},
    "over-temperature": lambda rng, n: {"kind": "temperature", "node": n, "celsius": 95.0},
}  # fmt: skip


def plans(cell: Cell, rng: np.random.Generator) -> tuple[list[PlanLog], np.ndarray]:
    """A short move of each arm, which enables it, and a long one of both; and where that ends."""
    counts = CountMap(cell.axes)
    start = counts.to_position(counts.to_counts(np.array([axis.drive.start for axis in cell.axes])))
    near = start + 1e-3
    low, high = np.array([axis.soft_limits for axis in cell.axes]).T
    sign = np.where(near > (low + high) / 2, -1.0, 1.0)
    far = near + sign * rng.uniform(0.25, 0.4, len(near))
    logs = []
    ways = (("wukong", start, near), ("kingkong", start, near), ("both", near, far))
    for number, (group, a, b) in enumerate(ways, 1):
        axes = list(cell.axis_indices(group))
        logs.append(as_log(joint_plan(cell, group, list(a[axes]), list(b[axes]), number), group))
    return logs, far


def run(directory: Path, make: Make, seed: int) -> tuple[Cell, Run, np.ndarray, int]:
    """Plays the moves with one fault in one drive of kingkong; also where the move ends and the drive's index."""
    rng = np.random.default_rng(seed)
    cell_file = directory / "cell.toml"
    cell_file.write_text(eod_text(), encoding="utf-8")
    cell = parse_cell(eod_text()).on_simcan(str(directory))
    logs, far = plans(cell, rng)
    node = int(rng.integers(1, 7))
    fault = {"bus": "kingkong", "at_sync": int(rng.choice(UNDER_WAY)), **make(rng, node)}
    with emulated(cell_file, directory, [fault], seed):
        return cell, play(cell, logs), far, node - 1


@pytest.mark.campaign
@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", TOLERATED)
def test_tolerated(tmp_path: Path, name: str, seed: int) -> None:
    cell, done, far, _ = run(tmp_path, TOLERATED[name], seed)
    assert done.failure is None
    standing = (done.records["group_state"] == GroupState.STANDSTILL).all(axis=1)
    assert (done.records["position"][standing][-1] == far).all()
    keeps_limits(cell, done.records, list(range(12)), "limits")
    assert not faults_in(tmp_path / "frames.log")


@pytest.mark.campaign
@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", STOPPING)
def test_stops_the_group_and_nobody_else_jerks(tmp_path: Path, name: str, seed: int) -> None:
    cell, done, far, axis = run(tmp_path, STOPPING[name], seed)
    assert done.failure is not None
    states = done.records["group_state"]
    assert GroupState.FAULT in states[:, KINGKONG]
    stopping = np.flatnonzero((states == GroupState.STOPPING).any(axis=1))
    assert stopping.size
    assert not (states[stopping[-1] + 1 :] == GroupState.MOVING).any()
    healthy = [i for i in range(12) if i != axis]
    keeps_limits(cell, done.records, healthy, "stop_limits")
    assert not (done.records["position"][-1][healthy] == far[healthy]).any()
    stays_disabled(tmp_path / "frames.log", axis + 1)


def keeps_limits(cell: Cell, records: Records, axes: list[int], which: str) -> None:
    """V, A and J of the setpoints, for each arm while it is enabled."""
    for group, members in enumerate((range(6), range(6, 12))):
        enabled = ~np.isin(records["group_state"][:, group], (GroupState.DISABLED, GroupState.FAULT))
        ticks = np.flatnonzero(enabled)
        assert (np.diff(ticks) == 1).all()
        within(cell, records["position"][ticks], [i for i in axes if i in members], which)


def within(cell: Cell, positions: np.ndarray, axes: list[int], which: str) -> None:
    """Differences of these columns against the limits; rounding as in float64."""
    q = positions[:, axes]
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        of = "limits" if name == "velocity" else which
        bound = np.array([getattr(getattr(cell.axes[i], of), name) for i in axes])
        rounding = 2**order * 4 * np.finfo(float).eps * np.maximum(np.abs(q).max(axis=0), 1.0) / cell.period**order
        most = np.abs(np.diff(q, n=order, axis=0)).max(axis=0) / cell.period**order
        assert (most <= bound * (1 + 1e-9) + rounding).all(), (name, most / bound)


def frames(path: Path) -> list[tuple[str, int, bytes]]:
    """Bus, identifier and data of each frame, in order."""
    rows = []
    for line in path.read_text().splitlines():
        _, bus, frame = line.split(" ")
        identifier, data = frame.split("#")
        rows.append((bus, int(identifier, 16), bytes.fromhex(data)))
    return rows


def faults_in(path: Path) -> list[str]:
    """Errors that a drive has reported."""
    return [data.hex() for _, can_id, data in frames(path) if 0x080 < can_id < 0x100 and data[:2] != b"\0\0"]


def stays_disabled(path: Path, node: int) -> None:
    """Once out of operation enabled, the drive is not enabled again."""
    words = [data[0] & 0x6F for bus, can_id, data in frames(path) if bus == "kingkong" and can_id == 0x180 + node]
    enabled = np.array([word == 0x27 for word in words])
    assert np.count_nonzero(np.diff(enabled.astype(int)) == 1) == 1
