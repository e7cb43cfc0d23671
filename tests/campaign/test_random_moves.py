"""Random moves of random groups, in lock-step: every limit kept, every target reached, frames as logged."""

from pathlib import Path

import numpy as np
import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_service.mapper.counts import CountMap
from support.cells import eod_text
from support.lock_step import as_log, emulated, play
from support.plans import joint_plan

MOVES = 6


@pytest.mark.campaign
@pytest.mark.timeout(600)
@pytest.mark.parametrize("seed", range(20))
def test_random_moves(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cell_file = tmp_path / "cell.toml"
    cell_file.write_text(eod_text(), encoding="utf-8")
    cell = parse_cell(eod_text()).on_simcan(str(tmp_path))
    counts = CountMap(cell.axes)
    position = counts.to_position(counts.to_counts(np.array([axis.drive.start for axis in cell.axes])))
    low, high = np.array([axis.soft_limits for axis in cell.axes]).T
    plans, targets = [], []
    for plan_id in range(1, MOVES + 1):
        group = str(rng.choice(["kingkong", "wukong", "both"]))
        axes = list(cell.axis_indices(group))
        target = position.copy()
        reach = rng.uniform(-0.4, 0.4, len(axes)) * rng.choice([0.0, 1e-3, 1.0], len(axes))
        target[axes] = np.clip(position[axes] + reach, low[axes], high[axes])
        plans.append(as_log(joint_plan(cell, group, list(position[axes]), list(target[axes]), plan_id), group))
        position = target
        targets.append(target)
    with emulated(cell_file, tmp_path):
        done = play(cell, plans)
    assert done.failure is None
    records = done.records
    standing = (records["group_state"] == GroupState.STANDSTILL).all(axis=1)
    for target in targets:
        assert (records["position"][standing] == target).all(axis=1).any()
    commanded = np.flatnonzero((records["group_state"] != GroupState.DISABLED).all(axis=1))
    q = records["position"][commanded[0] : commanded[-1] + 1]
    period = cell.period
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        bound = np.array([getattr(axis.limits, name) for axis in cell.axes])
        rounding = 2**order * 4 * np.finfo(float).eps * np.maximum(np.abs(q).max(axis=0), 1.0) / period**order
        assert (np.abs(np.diff(q, n=order, axis=0)).max(axis=0) / period**order <= bound * (1 + 1e-12) + rounding).all()
