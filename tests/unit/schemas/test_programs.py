"""Program files: units, the wire form they become, and refusals that name the step and the key."""

import json
import math
from pathlib import Path

import pytest

from axisync_schemas.moves import (
    Circle,
    CircularMove,
    Dwell,
    JointMove,
    LinearMove,
    Lissajous,
    Orientation,
    PathMove,
    SequenceMove,
    ToolPose,
)
from axisync_schemas.programs import ProgramError, parse_program, read_program

HEAD = 'schema = 1\nname = "p"\ngroup = "kingkong"\n'
EVERYTHING = """
schema = 1
name = "tool change"
description = "with one of each"
group = "both"
speed_scale = 0.5

[[steps]]
kind = "joint"
target_deg = [0, -90.0]
minimise = "jerk"

[[steps]]
kind = "joint"
frame = "body"
target = { position_mm = [1, 2, 3], quaternion = [0, 0, 0, 1] }

[[steps]]
kind = "linear"
target = { position_m = [0.1, 0.2, 0.3], euler_zyz_deg = [0, 180, 0] }
linear_limits = { velocity_m_s = 0.1, acceleration_m_s2 = 0.2, jerk_m_s3 = 0.3 }
angular_limits = { velocity_deg_s = 30, acceleration_deg_s2 = 40, jerk_deg_s3 = 80 }
contacts = [["kingkong.6", "equipment"]]
retime = false

[[steps]]
kind = "linear"
relative = true
target.kingkong = { position_mm = [0, 0, 50] }
target.wukong = { position_mm = [0, 0, -50], euler_zyz_rad = [0, 1.5, 0] }

[[steps]]
kind = "circular"
via = { position_mm = [10, 10, 0] }
target = { position_mm = [20, 0, 0] }

[[steps]]
kind = "path"
curve = { type = "helix", centre_mm = [1, 2, 3], angle_deg = 720, pitch_mm = 5, normal = [0, 1, 0] }
end = { quaternion = [0, 0, 0, 1] }
duration_s = 12

[[steps]]
kind = "path"
curve = { type = "lissajous", amplitude_m = [0.1, 0.2, 0], frequency = [1, 2, 0], phase_deg = [90, 0, 0] }

[[steps]]
kind = "dwell"
duration_s = 0.5
"""


def test_every_kind_becomes_exactly_what_is_sent() -> None:
    program = parse_program(EVERYTHING)
    assert (program.name, program.group, program.speed_scale) == ("tool change", "both", 0.5)
    assert program.description == "with one of each"
    limits = tuple(math.radians(value) for value in (30, 40, 80))
    lifted, lowered = ToolPose(position=(0, 0, 0.05)), ToolPose(position=(0, 0, -0.05), euler_zyz=(0, 1.5, 0))
    assert program.move == SequenceMove(
        steps=(
            JointMove(target=(0.0, math.radians(-90)), minimise="jerk"),
            JointMove(target=ToolPose(position=(0.001, 0.002, 0.003), quaternion=(0, 0, 0, 1)), frame="body"),
            LinearMove(
                target=ToolPose(position=(0.1, 0.2, 0.3), euler_zyz=(0, math.pi, 0)),
                linear_limits=(0.1, 0.2, 0.3),
                angular_limits=limits,
                contacts=(("kingkong.6", "equipment"),),
                retime=False,
            ),
            LinearMove(target={"kingkong": lifted, "wukong": lowered}, relative=True),
            CircularMove(via=ToolPose(position=(0.01, 0.01, 0.0)), target=ToolPose(position=(0.02, 0.0, 0.0))),
            PathMove(
                curve=Circle(
                    type="helix", centre=(0.001, 0.002, 0.003), angle=4 * math.pi, pitch=0.005, normal=(0, 1, 0)
                ),
                end=Orientation(quaternion=(0, 0, 0, 1)),
                duration_s=12.0,
            ),
            PathMove(curve=Lissajous(amplitude=(0.1, 0.2, 0), frequency=(1, 2, 0), phase=(math.pi / 2, 0, 0))),
            Dwell(duration_s=0.5),
        )
    )


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ("target_deg = [0]", "kind: "),
        ('kind = "spin"', "kind: Input tag 'spin'"),
        ('kind = "sequence"\nsteps = []', "kind: Input tag 'sequence'"),
        ('kind = "joint"', "target_deg or target_rad: Field required"),
        ('kind = "linear"', "target: Field required"),
        ('kind = "joint"\ntarget = [0]', "target: has no unit: write target_deg or target_rad, or target = {"),
        ('kind = "joint"\ntarget_deg = [0, "a"]', "target_deg[1]: must be numbers"),
        ('kind = "joint"\ntarget_deg = [true]', "target_deg[0]: must be numbers"),
        ('kind = "joint"\ntarget_deg = [nan]', "target_deg[0]: Input should be a finite number"),
        (f'kind = "joint"\ntarget_deg = [1{"0" * 400}]', "target_deg[0]: is too large"),
        ('kind = "joint"\ntarget_deg = [0]\ntarget_rad = [0]', "target_rad: target is given twice"),
        ('kind = "joint"\ntarget_deg = [0]\nspeed = 3', "speed: Extra inputs"),
        ('kind = "linear"\ntarget = { position = [0, 0, 0] }', "target.position: has no unit: write position_mm or"),
        ('kind = "linear"\ntarget = { position_mm = [0, 0] }', "target.position_mm[2]: Field required"),
        ('kind = "linear"\ntarget.a = { position_m = [0, 0] }', "target.a.position_m[2]: Field required"),
        ('kind = "circular"\nvia = { position_m = [0, 0, 0] }', "target: Field required"),
        (
            'kind = "linear"\ntarget = { position_m = [0, 0, 0], quaternion = [0, 0, 0, 2] }',
            "target: quaternion has length 2",
        ),
        (
            'kind = "linear"\ntarget = { position_m = [0, 0, 0] }\nlinear_limits = [1, 2, 3]',
            "linear_limits: must be a table of velocity_m_s, acceleration_m_s2, jerk_m_s3",
        ),
        (
            'kind = "linear"\ntarget = { position_m = [0, 0, 0] }\nangular_limits = { velocity = 1 }',
            "angular_limits: must be a table of velocity_deg_s",
        ),
        (
            'kind = "linear"\ntarget = { position_m = [0, 0, 0] }\nlinear_limits = { velocity_m_s = -1 }',
            "linear_limits.velocity_m_s: Input should be greater than 0",
        ),
        ('kind = "path"\ncurve = { centre_mm = [0, 0, 0] }', "curve.type: "),
        ('kind = "path"\ncurve = { type = "circle", radius_mm = 3 }', "curve.centre_mm or centre_m: Field required"),
        ('kind = "dwell"\nduration_s = 0', "duration_s: Input should be greater than 0"),
    ],
)
def test_faults_name_the_step_and_the_key(step: str, said: str) -> None:
    text = f'{HEAD}[[steps]]\nkind = "dwell"\nduration_s = 1\n[[steps]]\n{step}'
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p.toml")
    assert str(caught.value).splitlines()[0].startswith(f"p.toml: step 2 of 2: {said}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("schema = = 1", "line 1"),
        (HEAD, "p.toml: steps: Field required"),
        (HEAD + "steps = []", "p.toml: steps: "),
        (HEAD + "steps = [1]", "p.toml: steps[0]: "),
        (HEAD + 'colour = "red"\n[[steps]]\nkind = "dwell"\nduration_s = 1', "p.toml: colour: Extra inputs"),
        (HEAD.replace("schema = 1", "schema = 2"), "p.toml: schema: Input should be 1"),
        (HEAD.replace("kingkong", "king/kong"), "p.toml: group: "),
        (HEAD + "speed_scale = 1.5", "p.toml: speed_scale: "),
        (HEAD + "[[steps]]\n" * 257, "p.toml: steps: Tuple should have at most 256"),
    ],
)
def test_faults_of_the_whole_file(text: str, said: str) -> None:
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p.toml")
    assert said in str(caught.value)


def test_every_faulty_step_is_named_at_once() -> None:
    with pytest.raises(ProgramError) as caught:
        parse_program(HEAD + '[[steps]]\nkind = "dwell"\n' * 2)
    assert [line.split(": ")[1] for line in str(caught.value).splitlines()] == ["step 1 of 2", "step 2 of 2"]


def test_a_json_file_is_what_is_sent(tmp_path: Path) -> None:
    path = tmp_path / "line.json"
    body = {"group": "kingkong", "move": {"kind": "linear", "target": {"position": [0, 0, 1]}}, "speed_scale": 0.25}
    path.write_text(json.dumps(body))
    program = read_program(path)
    assert (program.name, program.group, program.speed_scale) == ("line", "kingkong", 0.25)
    assert program.move == LinearMove(target=ToolPose(position=(0.0, 0.0, 1.0)))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"group": "a"}', "move: Field required"),
        (
            '{"group": "a", "move": {"kind": "linear", "target": {"position": [0, 0]}}}',
            "move.target.position[2]: Field",
        ),
        ('{"group": "a", "move": {"kind": "joint", "target": [0]}, "name": "x"}', "name: Extra inputs"),
        ("{", "the whole file: Invalid JSON"),
    ],
)
def test_faults_of_a_json_file(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "p.json"
    path.write_text(text)
    with pytest.raises(ProgramError) as caught:
        read_program(path)
    assert str(caught.value).startswith(f"{path}: {said}")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe9"')
    for name, said in (
        ("no.toml", "cannot be read: No such file"),
        ("latin.toml", "it is not UTF-8"),
        ("program.yaml", "a program is a .toml file"),
    ):
        with pytest.raises(ProgramError, match=said):
            read_program(tmp_path / name)
