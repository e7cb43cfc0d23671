"""Every frame of a bring-up and of a short move, byte by byte and with its time on the bus, against files.

After a change that is meant to be seen on the bus: `AXISYNC_GOLDEN=write pytest tests/golden`, and read the difference.
"""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.internal import BeginCommand, GroupCommand
from axisync_schemas.log_models import PlanLog
from axisync_service.mapper.counts import CountMap
from support.cells import eod_text, small
from support.lock_step import Script, Steps, as_log, conduct, emulated
from support.plans import joint_plan

HERE = Path(__file__).parent
FILES = ("bring_up.log", "move.log")
TICKS_UP = 150
ARC_DEG = 0.05


def the_plan(cell: Cell) -> PlanLog:
    """KingKong's one axis a little way on."""
    counts = CountMap(cell.axes[:1])
    start = counts.to_position(counts.to_counts(np.array([cell.axes[0].drive.start]))).tolist()
    return as_log(joint_plan(cell, "kingkong", start, [start[0] + math.radians(ARC_DEG)]), "kingkong")


def steps(plan: PlanLog) -> Steps:
    for _ in range(TICKS_UP):
        yield None
    yield GroupCommand(op="enable", ref=0, group="kingkong")
    yield BeginCommand(ref=0, group="kingkong", plan_id=plan.plan_id, slot=0, epochs=())
    for _ in range(round(plan.knots[-1] / 0.002) + 10):
        yield None


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The run's frames by golden file: before the first SYNC after `enable`, and from it on."""
    directory = tmp_path_factory.mktemp("golden")
    cell_file = directory / "cell.toml"
    cell_file.write_text(small(eod_text(), axes=1), encoding="utf-8")
    cell = parse_cell(cell_file.read_text(encoding="utf-8")).on_simcan(str(directory))
    plan = the_plan(cell)
    with emulated(cell_file, directory):
        done = conduct(cell, Script(steps(plan)), [plan])
    assert done.failure is None
    lines = (directory / "frames.log").read_text(encoding="ascii").splitlines(keepends=True)
    shutdown = next(i for i, line in enumerate(lines) if " 201#0600" in line)
    return {"bring_up.log": "".join(lines[:shutdown]), "move.log": "".join(lines[shutdown:])}


@pytest.mark.parametrize("name", FILES)
def test_frames_are_the_golden_ones(frames: dict[str, str], name: str) -> None:
    path = HERE / name
    if os.environ.get("AXISYNC_GOLDEN") == "write":
        path.write_text(frames[name], encoding="ascii")
    expected, found = path.read_text(encoding="ascii").splitlines(), frames[name].splitlines()
    for number, (want, have) in enumerate(zip(expected, found, strict=False), start=1):
        assert have == want, f"{name}, line {number}"
    assert len(found) == len(expected)


def test_the_golden_files_show_what_they_should() -> None:
    """Written by hand after CiA 301 and 402, so that a wrong file cannot be committed unseen."""
    up, move = ((HERE / name).read_text(encoding="ascii") for name in FILES)
    for frame in (
        "kingkong 601#4018100100000000",  # identity: vendor
        "kingkong 581#4318100153495841",
        "kingkong 000#8001",  # NMT: pre-operational
        "kingkong 601#2F60600008000000",  # csp
        "kingkong 601#2FC2600102000000",  # 2 ms
        "kingkong 601#2FC26002FD000000",
        "kingkong 601#2300180181010080",  # TPDO1 off, then on
        "kingkong 601#2300180181010000",
        "kingkong 000#0101",  # NMT: operational
        "kingkong 701#05",
    ):
        assert frame in up, frame
    words = [line.split("#")[1][:4] for line in move.splitlines() if " kingkong 201#" in line]
    assert list(dict.fromkeys(words)) == ["0600", "0700", "0F00", "0000"]
