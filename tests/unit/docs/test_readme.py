"""What README has a new user type is accepted where the demo's programs end, one command after the other."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisync_cli.move_options import Asked
from axisync_client import Program, deg, moves
from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.internal import Jog, PlanJob
from axisync_schemas.programs import read_program
from axisync_service.demo import PROGRAMS, SLOW, patient, program_for
from axisync_service.planner.jog_plan import plan_jog
from axisync_service.planner.models import Models
from support.documents import ROOT, command_lines, parsed, python_blocks
from support.planner_jobs import CELL, REST, TEXT, plan_of, planned

README = ROOT / "README.md"
COMMANDS = [words[1:] for words in command_lines(README)]
SNIPPETS = python_blocks(README)


class Robot:
    """Where both arms are after what was planned."""

    def __init__(self, cell: Cell) -> None:
        self.at, self.models = np.array(REST), Models(cell)
        for words in program_for(cell):
            if words[0] == "run":
                self.play(read_program(PROGRAMS / Path(words[1]).name), 0.5 if words[2:] == SLOW else 1.0)

    def play(self, program: Program, speed: float = 1.0, commit: bool = True) -> None:
        axes = list(CELL.axis_indices(program.group))
        at = {"start": tuple(self.at[axes]), "rest": tuple(self.at)}
        speed *= program.speed_scale
        result = planned(program.move, self.models, group=program.group, speed_scale=speed, **at)
        if commit:
            self.at[axes] = plan_of(result).end

    def jog(self, group: str, velocity: tuple[float, ...], seconds: float) -> None:
        """With the tool, in O; it must be free to go on for so long."""
        at, move = tuple(self.at[list(CELL.axis_indices(group))]), Jog(space="body", velocity=velocity)
        job = PlanJob(ref=1, plan_id=1, slot=0, group=group, start=at, rest=tuple(self.at), speed_scale=1.0, move=move)
        plan = plan_jog(self.models, job, ()).plan
        assert plan is not None
        assert plan.knots[-1] > seconds


@pytest.fixture(scope="module", params=[True, False], ids=["real time", "late drives"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """As the demo runs where it has real-time priority, and where it has not."""
    return Robot(parse_cell(patient(TEXT, request.param)))


def test_every_move_is_accepted_in_turn(robot: Robot) -> None:
    asked = [words for words in COMMANDS if words[0] in ("plan", "move", "run")]
    assert len(asked) >= 5
    for words in asked:
        options = parsed(["axisync", *words])
        if words[0] == "run":
            program = read_program(ROOT / options["file"])
        else:
            program = Asked(**{name: value for name, value in options.items() if name in Asked.__slots__}).program()
        robot.play(program, options.get("speed", 1.0), commit=words[0] != "plan")


def test_every_snippet_is_accepted_after_it(robot: Robot) -> None:
    class Arm:
        def __init__(self, group: str) -> None:
            self.group = group

        def move_joint(self, target: Any, **options: Any) -> None:
            robot.play(Program(name="snippet", group=self.group, move=moves.joint(target, **options)))

    snippet, jogs = SNIPPETS
    ((target, options),) = re.findall(r"arm\.move_joint\((deg\([^)]*\))(.*?)\)", snippet)
    (group,) = re.findall(r'lease\("(\w+)"\)', snippet)
    eval(f"arm.move_joint({target}{options})", {"arm": Arm(group), "deg": deg})
    assert f'lease("{group}")' in jogs
    velocities = [tuple(map(float, found.split(","))) for found in re.findall(r"velocity ?= ?\(([^)]*)\)", jogs)]
    assert len(velocities) == 2
    for velocity in velocities:
        robot.jog(group, velocity, 1.0)
