"""The committed pictures show what the library computes and the paper prints; redraw with docs/draw_figures.py.

Not the bytes are compared, which depend on the version of matplotlib, but the curves: their points, back in data units.
"""

import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from axisync_cli import plan_plot
from axisync_cli.plan_curves import Curves
from support.drawn import lines_in

FIGURES = Path(__file__).parents[3] / "docs" / "figures"
NAMES = [*(f"figure-{number:02}" for number in (*range(6, 15), 16)), "pulses"]
DRAWN = 1e-4
"""Of a panel's height: digits of a coordinate in the file."""


def committed(name: str, curves: Curves, size: tuple[float, float]) -> dict[str, np.ndarray]:
    """[k, 2] times and values of each line in the file, read by the scales that a drawing of `curves` has."""
    return lines_in(FIGURES / f"{name}.svg", plan_plot.draw(curves, size))


@pytest.fixture(scope="module")
def lines(script: ModuleType) -> dict[str, dict[str, np.ndarray]]:
    return {name: committed(name, script.DRAWINGS[name](), script.SIZE) for name in NAMES}


def test_every_drawing_is_committed_and_shown(script: ModuleType) -> None:
    page = (FIGURES.parent / "planner.md").read_text()
    assert sorted(script.DRAWINGS) == sorted(NAMES) == sorted(path.stem for path in FIGURES.glob("[fp]*.svg"))
    assert sorted(re.findall(r"\(figures/(.*?)\.svg\)", page)) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_figure_shows_the_librarys_curves(script: ModuleType, lines: dict, name: str) -> None:
    curves = script.DRAWINGS[name]()
    for order, (title, _) in enumerate(plan_plot.PANELS):
        height = max(np.ptp(values[order]) for values in curves.values)
        for axis, (times, values) in enumerate(zip(curves.times, curves.values, strict=True), 1):
            points = lines[name][f"{title}-{axis}"]
            expected = np.column_stack(plan_plot.corners(times, values[order]))
            assert points.shape == expected.shape
            assert points[:, 0] == pytest.approx(expected[:, 0], abs=DRAWN * curves.duration)
            assert points[:, 1] == pytest.approx(expected[:, 1], abs=DRAWN * height)


@pytest.mark.parametrize(
    ("name", "duration", "peaks"),
    [
        ("figure-06", 6.6667, {"velocity": 20.0, "acceleration": 20.0, "jerk": 30.0}),
        ("figure-07", 3.0, {"acceleration": 20.0, "jerk": 30.0}),
        ("figure-08", 2.2013, {"jerk": 30.0}),
        ("figure-09", 7.0, {"acceleration": 20.0, "jerk": 30.0}),
        ("figure-10", 20.0, {"velocity": 5.2176, "jerk": 30.0}),
        ("figure-11", 7.0, {"velocity": 20.0, "acceleration": 30.0 * 0.4226, "jerk": 30.0}),
        ("figure-12", 20.0, {"acceleration": 30.0 * 0.03345, "jerk": 30.0}),
        ("figure-13", 7.0, {"velocity": 20.0, "acceleration": 20.0, "jerk": 20.0}),
        ("figure-14", 20.0, {"acceleration": 2.0, "jerk": 0.4}),
    ],
)
def test_figure_has_the_papers_numbers(lines: dict, name: str, duration: float, peaks: dict[str, float]) -> None:
    """Of section V.A; the peaks that it prints or that follow from a printed time."""
    assert lines[name]["position-1"][-1, 0] == pytest.approx(duration, rel=1e-3)
    for title, peak in peaks.items():
        assert np.abs(lines[name][f"{title}-1"][:, 1]).max() == pytest.approx(peak, rel=1e-3)


def test_figure_16_has_the_papers_move(lines: dict) -> None:
    """Section V.B.1: from P1 to P2 in 5.25 s, and the jerks of f_J^-1."""
    figure = lines["figure-16"]
    axes = range(1, 7)
    assert [figure[f"position-{i}"][0, 1] for i in axes] == pytest.approx([0, -150, 60, -45, -45, 45], abs=0.1)
    assert [figure[f"position-{i}"][-1, 1] for i in axes] == pytest.approx([100, -90, -60, -120, 45, 45], abs=0.1)
    assert [figure[f"position-{i}"][-1, 0] for i in axes] == pytest.approx([5.25] * 6, rel=1e-3)
    jerks = [np.abs(figure[f"jerk-{i}"][:, 1]).max() for i in axes]
    assert jerks == pytest.approx([32.665, 13.269, 80.0, 16.586, 23.704, 0.0], abs=0.05)


def test_drawing_again_gives_the_same_bytes(script: ModuleType, tmp_path: Path) -> None:
    files = [tmp_path / "one.svg", tmp_path / "two.svg"]
    for path in files:
        plan_plot.write(plan_plot.draw(script.DRAWINGS["figure-16"](), script.SIZE), path)
    one, two = (path.read_bytes() for path in files)
    assert one == two
    assert b"date" not in one
    assert len(one) < 60_000
