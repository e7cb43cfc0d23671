"""Pictures of plans, and what is said where there can be none."""

import sys
from importlib import util
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from axisync_cli import plan_plot
from axisync_cli.plan_curves import Curves
from support.cell_peer import Peer
from support.command_line import Run

PLAN = ("plan", "kingkong", "--joint", "-90,60,-45,0,0,0deg")
PNG = b"\x89PNG\r\n\x1a\n"


def without_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    found = util.find_spec
    monkeypatch.setattr(plan_plot, "find_spec", lambda name: None if name == "matplotlib" else found(name))
    monkeypatch.setitem(sys.modules, "matplotlib", None)


def test_a_plan_is_drawn(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "move.svg"
    shown = run(*PLAN, "--plot", str(path))
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.splitlines()[-1] == f"drawn in {path}"
    assert "limited by kingkong.2" in shown.out
    tree = ElementTree.parse(path)
    ids = {element.get("id") for element in tree.iter()}
    assert {f"{panel}-{axis}" for panel, _ in plan_plot.PANELS for axis in range(1, 7)} <= ids
    words = {element.text for element in tree.iter() if element.tag.endswith("text")}
    assert {
        "position, deg",
        "velocity, deg/s",
        "acceleration, deg/s²",
        "jerk, deg/s³",
        "time, s",
        "kingkong.6",
    } <= words


def test_a_plan_is_drawn_for_programs_too(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "move.png"
    shown = run(*PLAN, "--plot", str(path), "--json")
    assert (shown.code, shown.json["limiting"]) == (0, "kingkong.2")
    assert path.read_bytes().startswith(PNG)


def test_a_path_is_drawn_with_both_of_its_units(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "line.svg"
    assert run("plan", "kingkong", "--linear", "300,0,120mm", "--plot", str(path)).code == 0
    words = {element.text for element in ElementTree.parse(path).iter() if element.tag.endswith("text")}
    assert {"velocity, mm/s, deg/s", "length, mm", "rotation, deg"} <= words


def test_several_steps_cannot_be_drawn(run: Run, peer: Peer, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    program = tmp_path / "wait.toml"
    program.write_text('schema = 1\nname = "w"\ngroup = "kingkong"\n[[steps]]\nkind = "dwell"\nduration_s = 1')
    shown = run("plan", "--file", str(program), "--plot", str(tmp_path / "wait.svg"))
    assert (shown.code, shown.err.count("\n")) == (1, 1)
    assert "has no curves in its plan" in shown.err
    assert not any(verb == "plan" for verb, _, _ in peer.requests)


def test_two_arms_fit_into_one_picture(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "both.svg"
    joint = ",".join(["1"] * 12) + "deg"
    assert run("plan", "both", "--relative", "--joint", joint, "--plot", str(path)).code == 0
    assert "wukong.6" in path.read_text()


def test_without_matplotlib_it_says_how_to_get_it(
    run: Run, peer: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_matplotlib(monkeypatch)
    shown = run(*PLAN, "--plot", str(tmp_path / "move.svg"))
    assert (shown.code, shown.out) == (1, "")
    assert shown.err.startswith("a picture needs matplotlib, which is not installed: run `")
    assert "pip install matplotlib" in shown.err
    assert shown.err.count("\n") == 1
    assert not any(verb == "plan" for verb, _, _ in peer.requests)
    assert run(*PLAN).code == 0
    assert run(*PLAN, "--plot", "move.svg", "--json").json["code"] == "UNAVAILABLE"


def test_a_file_that_cannot_be_written(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "nowhere" / "move.svg"
    shown = run(*PLAN, "--plot", str(path))
    assert shown.code == 1
    assert shown.err == f"{path} cannot be written: No such file or directory\n"


@pytest.mark.parametrize("name", ["move.pdf", "move", "svg"])
def test_other_formats_are_a_usage_error(run: Run, name: str) -> None:
    shown = run(*PLAN, "--plot", name)
    assert shown.code == 2
    assert "must end in .svg or .png" in shown.err


def test_nothing_to_move_is_still_a_picture(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    still = Curves(("one",), (np.zeros(2),), (np.zeros((4, 2)),), "deg")
    plan_plot.save(still, tmp_path / "still.svg")
    assert (tmp_path / "still.svg").stat().st_size > 1000


def test_corners_keep_what_bends() -> None:
    times = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0])
    kept, values = plan_plot.corners(times, np.array([0.0, 1.0, 2.0, 5.0, 5.0, 5.0]))
    assert kept.tolist() == [0.0, 2.0, 2.0, 4.0]
    assert values.tolist() == [0.0, 2.0, 5.0, 5.0]
    smooth = np.linspace(0.0, 1.0, 20)
    assert len(plan_plot.corners(smooth, smooth**2)[0]) == 20
