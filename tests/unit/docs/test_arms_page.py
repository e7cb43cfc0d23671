"""Examples, tables and pictures of docs/arms.md are what they say they are."""

import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from axisync_client import Program
from axisync_schemas.programs import parse_program
from support.drawn import POINT, SVG, lines_in
from support.planner_jobs import MODELS, REST, planned, trajectory_of

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "arms.md").read_text()
PICTURES = {path.stem: path for path in (DOCS / "figures").glob("arms-*.svg")}
NUMBER = re.compile(r"\d+(?:\.\d+)?")
PERIOD_S = 0.002
DRAWN = 2e-3
"""Of a panel's height: thinning, which may move the scales, and digits in the file."""


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def moves() -> list[dict[str, Any]]:
    return [json.loads(line) for block in blocks("json") for line in block.splitlines()]


@pytest.mark.parametrize("move", moves(), ids=lambda move: str(move["kind"]))
def test_every_json_example_is_accepted_where_the_demo_begins(move: dict[str, Any]) -> None:
    assert planned(move, MODELS, start=REST[:6]).reply.duration_s > 0.0


def test_every_kind_has_an_example() -> None:
    assert {move["kind"] for move in moves()} == {"joint", "linear", "circular", "path", "sequence"}


def test_the_program_is_one() -> None:
    (text,) = (text for text in blocks("toml") if "[[steps]]" in text)
    program = parse_program(text)
    assert planned(program.move, MODELS, speed_scale=program.speed_scale).reply.steps[1].kind == "linear"


def test_the_lissajous_figure_is_stretched_as_told() -> None:
    (move,) = (move for move in moves() if move.get("curve", {}).get("type") == "lissajous")
    assert planned(move, MODELS).reply.scale == pytest.approx(10.0, abs=1.0)


def test_the_papers_line_has_the_numbers_told(arms: ModuleType) -> None:
    reply = planned(arms.LINE.move, MODELS, start=start_of(arms.LINE)).reply
    assert (reply.scale, reply.duration_s) == (pytest.approx(1.405, abs=5e-4), pytest.approx(4.15, abs=5e-3))
    assert "k is 1.405, and the line takes 4.15 s" in re.sub(r"\s+", " ", PAGE)


def test_durations_beside_toppra_are_current(arms: ModuleType) -> None:
    shown, computed = arms.table_in(PAGE, "retimed"), arms.retimed()
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", computed)
    one, other = (list(map(float, NUMBER.findall(text))) for text in (shown, computed))
    assert one == pytest.approx(other, abs=0.011)


def test_every_picture_is_shown_and_small(arms: ModuleType) -> None:
    assert sorted(arms.DRAWINGS) == sorted(PICTURES) == sorted(re.findall(r"\(figures/(.*?)\.svg\)", PAGE))
    assert max(path.stat().st_size for path in PICTURES.values()) < 400_000


def start_of(program: Program) -> tuple[float, ...]:
    return REST[6:] if program.group == "wukong" else tuple(np.radians([-90.0, -150.0, 45.0, -90.0, -90.0, -90.0]))


@pytest.mark.parametrize(("name", "attribute"), [("arms-20", "LINE"), ("arms-28", "POINTS"), ("arms-31", "CHANGE")])
def test_joint_curves_are_those_of_the_plan(arms: ModuleType, name: str, attribute: str) -> None:
    """What was logged on the day of drawing is what is planned today."""
    program = getattr(arms, attribute)
    path = trajectory_of(planned(program.move, MODELS, group=program.group, start=start_of(program)))
    times = np.append(np.arange(0.0, path.duration, PERIOD_S), path.duration)
    states = np.degrees(np.stack(path.sample(times)))
    names = tuple(f"axis {i + 1}" for i in range(6))
    lines = lines_in(PICTURES[name], arms.plan_plot.draw(arms.curves(names, times, states, "deg"), arms.SIZE))
    for order, title in enumerate(("position", "velocity", "acceleration")):
        for axis in range(6):
            at, values = lines[f"{title}-{axis + 1}"].T
            expected = np.interp(at, times, states[order, :, axis])
            assert values == pytest.approx(expected, abs=DRAWN * np.ptp(states[order]))


PULSES = ("constant", "parabolic")


@pytest.mark.parametrize("name", ["arms-20d", "arms-31d"])
def test_drawn_jerk_jumps_with_constant_pulses_and_not_with_parabolic_ones(name: str) -> None:
    """Steepest change between neighbouring points, in the file's own units."""
    jumps = {pulse: max(map(steepest, raw_lines(PICTURES[name], pulse))) for pulse in PULSES}
    assert jumps["constant"] > 4.0 * jumps["parabolic"]


def raw_lines(picture: Path, pulse: str) -> list[np.ndarray]:
    """[k, 2] of each axis, in points of the file."""
    tree = ElementTree.parse(picture)
    paths = [tree.find(f".//{SVG}g[@id='{pulse}-{axis}']/{SVG}path") for axis in range(1, 7)]
    return [np.array(POINT.findall(path.get("d", "")), dtype=float) for path in paths if path is not None]


def steepest(line: np.ndarray) -> float:
    step = np.abs(np.diff(line, axis=0))
    return float((step[:, 1] / np.maximum(step[:, 0], 1e-3)).max())
