"""The program files that come with the service."""

import math
from pathlib import Path

import numpy as np
import pytest

import axisync_service
from axisync_robot.arm import Arm
from axisync_schemas.moves import SequenceMove
from axisync_schemas.programs import Program, read_program
from support.planner_jobs import CELL, MODELS, REST, planned, trajectory_of

FILES = sorted((Path(axisync_service.__file__).parent / "programs").glob("*.toml"))
POINTS = {3: (-0.2719, 0.157, 0.1), 5: (-0.2719, 0.157, 0.3), 7: (-0.3484, 0.23, 0.1), 9: (-0.3484, 0.23, 0.3)}
"""B, A, D, C of section V.C.2: where these steps of the tool change end, m in O."""


def start_of(program: Program) -> tuple[float, ...]:
    return tuple(REST[i] for i in CELL.axis_indices(program.group))


def test_all_are_there() -> None:
    assert [path.stem for path in FILES] == ["tool_change", "two_arms", "wukong_points"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.stem))
def test_it_is_accepted_where_the_demo_begins(path: Path) -> None:
    program = read_program(path)
    reply = planned(program.move, MODELS, group=program.group, start=start_of(program)).reply
    assert isinstance(program.move, SequenceMove)
    assert len(reply.steps) == len(program.move.steps)
    assert reply.min_distance_m is not None
    assert reply.min_distance_m > CELL.geometry.margin
    assert reply.alone is not None
    assert reply.alone.min_distance_m is not None
    assert reply.alone.min_distance_m > 0.0


def test_the_tool_change_passes_the_papers_points_with_the_tool_down() -> None:
    program = read_program(FILES[0])
    result = planned(program.move, MODELS, start=start_of(program))
    path, arm = trajectory_of(result), Arm.of(CELL.groups[0])
    assert arm is not None
    for step, point in POINTS.items():
        report = result.reply.steps[step]
        pose = arm.placement(path.sample(np.array([report.begins_s + report.duration_s]))[0][0])
        assert pose[:3, 3] == pytest.approx(point, abs=1e-9)
        assert pose[:3, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    assert math.isclose(result.reply.duration_s, path.duration)
