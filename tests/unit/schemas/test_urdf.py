"""URDF files in cell files: carried along in one text, refused with path and sentence, remarks for `axisyncd check`."""

import math
import shutil
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, CellError, override, parse_cell, read_cell
from axisync_schemas.cell_remarks import remarks
from axisync_schemas.cell_text import with_files
from support.arms import ELBOW_JOINTS, OFFSET_JOINTS, URDF, urdf_cell, urdf_cell_text

ELBOW = (URDF / "elbow_arm.urdf").read_text(encoding="utf-8")
CELL = urdf_cell_text("elbow_arm.urdf", ELBOW_JOINTS)


def written(folder: Path, urdf: str = ELBOW, cell: str = CELL) -> Path:
    (folder / "elbow_arm.urdf").write_text(urdf, encoding="utf-8")
    path = folder / "cell.toml"
    path.write_text(cell, encoding="utf-8")
    return path


def refusal(folder: Path, urdf: str = ELBOW, cell: str = CELL) -> str:
    path = written(folder, urdf, cell)
    with pytest.raises(CellError) as caught:
        read_cell(path)
    assert str(caught.value).startswith(f"{path}: groups[0]")
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_the_text_read_is_complete_without_the_file(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    cell, text = read_cell(written(tmp_path / "here"))
    shutil.rmtree(tmp_path / "here")
    copy = tmp_path / "there" / "cell.toml"
    copy.write_text(override(text, {"missed_ticks_max": 9}), encoding="utf-8")
    again, same = read_cell(copy)
    assert again.groups == cell.groups
    assert again.missed_ticks_max == 9
    assert same == copy.read_text(encoding="utf-8")
    urdf = cell.groups[0].urdf
    assert urdf is not None
    assert urdf.text == ELBOW
    assert text.startswith(CELL)


def test_json_carries_it_too() -> None:
    cell = urdf_cell("elbow_arm.urdf", ELBOW_JOINTS)
    assert Cell.model_validate_json(cell.model_dump_json(by_alias=True)).groups[0].urdf == cell.groups[0].urdf


@pytest.mark.parametrize("odd", ["it's '''quoted'''", 'a\\b "c" \t d', "grüße €"])
def test_any_text_comes_back(tmp_path: Path, odd: str) -> None:
    urdf = ELBOW.replace("KingKong's DH table", odd)
    cell, text = read_cell(written(tmp_path, urdf))
    for found in (cell, parse_cell(text)):
        held = found.groups[0].urdf
        assert held is not None
        assert held.text == urdf


def test_two_groups_name_one_file_once(tmp_path: Path) -> None:
    text = with_files(CELL, written(tmp_path).parent)
    assert with_files(text, tmp_path / "elsewhere") == text
    assert text.count("[files.") == 1


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    assert "no_arm.urdf cannot be read: No such file" in refusal(tmp_path, cell=CELL.replace("elbow_arm", "no_arm"))


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    path = written(tmp_path)
    (tmp_path / "elbow_arm.urdf").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CellError, match=r"groups\[0\].urdf.file: .* is no text"):
        read_cell(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</robot>", "", "elbow_arm.urdf: not XML: "),
        ("robot", "sdf", "the outermost element is <sdf>"),
        ('<link name="world"/>', '<x:macro xmlns:x="http://ros.org/xacro"/>', "expand it first"),
        ('<link name="tool0"/>', "", "names link 'tool0', which there is not"),
        ('<link name="tool0"/>', '<link name="tool0"/><link name="tool0"/>', "link tool0 more than once"),
        ('name="elbow" ', 'name="shoulder_lift" ', "joint shoulder_lift more than once"),
        ('<child link="wrist_1"/>', '<child link="upper_arm"/>', "link 'upper_arm' hangs on two joints"),
        ('<parent link="shoulder"/>', '<parent link="tool0"/>', "is in a loop"),
        ('<parent link="base_link"/>', '<parent link="base_link"/><mimic joint="elbow"/>', "mimics another"),
        ('name="elbow" type="revolute"', 'name="elbow" type="prismatic"', "joint 'elbow' is prismatic; axes turn"),
        ('name="elbow" type="revolute"', 'name="elbow" type="fixed"', "there is no joint 'elbow'; there are shoulder"),
        ('name="flange_tool0" type="fixed"', 'name="flange_tool0" type="continuous"', "'flange_tool0' has no axis"),
        ('xyz="0 0 0.1135"', 'xyz="0 0 high"', "joint 'shoulder_lift': xyz='0 0 high' is not 3 finite numbers"),
        ('xyz="0 -2 0"', 'xyz="0 0 0"', "joint 'elbow': its axis is zero"),
        ('<sphere radius="0.03"/>', '<sphere radius="-0.03"/>', "link 'flange': a sphere of size [-0.03]"),
        ('<link name="world"/>', '<link name="world"/><link name="moon"/>', "2 trees, under moon, world"),
    ],
)
def test_a_wrong_file_is_refused_with_a_sentence(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in ELBOW
    assert said in refusal(tmp_path, ELBOW.replace(old, new) if old == "robot" else ELBOW.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('tip = "tool0"', 'tip = "tool1"', "there is no link 'tool1'; there are base_link, finger, flange"),
        ('base = "base_link"', 'base = "finger"', "link 'tool0' does not hang on link 'finger'"),
        ('base = "base_link"', 'base = "shoulder"', "there is no joint 'shoulder_pan'"),
        ('joint = "elbow"', 'joint = "elbow_2"', "axis a3: elbow_arm.urdf, base_link to tool0: there is no joint"),
        ('joint = "elbow"', 'joint = "shoulder_lift"', "joint 'elbow' has no axis"),
        ('joint = "elbow"', "", "there is no joint 'a3'"),
        (
            'joint = "elbow"',
            "dh = { d_m = 0.1, a_m = 0, alpha_deg = 0 }",
            "axis a3 has a dh row, but the group's chain",
        ),
    ],
)
def test_a_cell_that_does_not_fit_its_file(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in CELL
    assert said in refusal(tmp_path, cell=CELL.replace(old, new, 1))


def test_axes_out_of_order(tmp_path: Path) -> None:
    first, second, *others = ELBOW_JOINTS
    text = urdf_cell_text("elbow_arm.urdf", (second, first, *others))
    assert "not in the order of the joints, shoulder_pan, shoulder_lift" in refusal(tmp_path, cell=text)


def test_a_joint_without_a_file() -> None:
    without = CELL.replace('urdf = { file = "elbow_arm.urdf", base = "base_link", tip = "tool0" }', "")
    with pytest.raises(CellError, match="axis a1 names a joint, but the group has no urdf"):
        parse_cell(without)


def test_a_base_is_the_outermost_link_where_none_is_given() -> None:
    text = CELL.replace('base = "base_link", ', "")
    urdf = parse_cell(with_files(text, URDF)).groups[0].urdf
    assert urdf is not None
    assert urdf.root == "world"


def test_remarks_on_what_is_not_used() -> None:
    assert tuple(remarks(urdf_cell("elbow_arm.urdf", ELBOW_JOINTS))) == (
        f"axis a1: hard_limits_deg -175 .. 175 hold; elbow_arm.urdf has {math.degrees(-3.05):g} .. 174.752",
        "elbow_arm.urdf: the shapes of link base_link, which no axis moves, are not used: give boxes for them",
        "elbow_arm.urdf: the meshes of link wrist_1 are not used: give radius_m or capsules of its axis",
    )
    assert len(tuple(remarks(urdf_cell("offset_wrist.urdf", OFFSET_JOINTS)))) == 3
