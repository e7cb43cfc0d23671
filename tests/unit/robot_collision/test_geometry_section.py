"""The cell file's geometry: optional, checked, and turned into shapes and pairs."""

import math

import numpy as np
import pytest

from axisync_robot.collision import CollisionModel
from axisync_robot.collision_shapes import Shapes
from axisync_schemas.cell import Cell, CellError, parse_cell


def test_a_file_without_geometry_watches_nothing(cell_text: str) -> None:
    lines = [line for line in cell_text.split("[geometry]")[0].splitlines() if not line.startswith("radius_m")]
    model = CollisionModel(parse_cell("\n".join(lines)))
    assert model.pairs == ()
    assert model.clearance([0.0] * 12) is None
    check = model.check_path(np.zeros((3, 12)))
    assert check.clear
    assert check.nearest is None
    assert check.min_distance == math.inf


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["kingkong.1", "body"]', '["kingkong.1", "bdy"]', "'bdy' is neither an axis nor a box"),
        ('["kingkong.1", "body"]', '["body", "body"]', "'body' with itself"),
        ('contacts = [["kingkong.6", ', 'contacts = [["kingkong.7", ', "'kingkong.7' is neither"),
        ('name = "equipment"', 'name = "body"', "body more than once"),
        ('name = "equipment"', 'name = "wukong.1"', "wukong.1 more than once"),
        ("margin_m = 0.005", "margin_m = -0.005", "geometry.margin_m"),
        ("radius_m = 0.04", "radius_m = 0", "radius_m"),
        ("size_m = [0.8, 0.2, 0.2]", "size_m = [0.8, 0.0, 0.2]", "geometry.boxes[0].size_m"),
        ("dh = { d_m = 0.1135, a_m = 0.0, alpha_deg = 90 }\n", "", "kingkong.1 needs a dh row"),
    ],
)
def test_refusals_name_the_place(cell_text: str, old: str, new: str, said: str) -> None:
    assert old in cell_text
    with pytest.raises(CellError) as refusal:
        parse_cell(cell_text.replace(old, new, 1))
    assert said in str(refusal.value)


def test_a_link_with_d_and_a_has_two_capsules(cell_text: str) -> None:
    row = "dh = { d_m = 0.0, a_m = -0.2436, alpha_deg = 0 }"
    shapes = Shapes.of(parse_cell(cell_text.replace(row, row.replace("d_m = 0.0", "d_m = 0.1"), 1)))
    first, second = (c for c in shapes.capsules if c.words == "kingkong link 2")
    assert [first.start.tolist(), first.end.tolist()] == [[0, 0, 0], [0, 0, 0.1]]
    assert [second.start.tolist(), second.end.tolist()] == [[0, 0, 0.1], [-0.2436, 0, 0.1]]


def test_capsules_of_the_file_replace_those_of_the_row(cell_text: str) -> None:
    own = "capsules = [{ from_m = [0, 0, 0.1], to_m = [0.2, 0, 0.1], radius_m = 0.07 }]"
    text = cell_text.replace('name = "kingkong.3"', f'name = "kingkong.3"\n{own}', 1)
    (capsule,) = (c for c in Shapes.of(parse_cell(text)).capsules if c.name == "kingkong.3")
    assert (capsule.end.tolist(), capsule.radius) == ([0.2, 0, 0.1], 0.07)


def test_pairs_are_all_but_neighbours_and_the_allowed(cell: Cell, model: CollisionModel) -> None:
    arms, links, boxes = ("kingkong", "wukong"), range(1, 7), ("body", "equipment")
    expected = {(f"{a} link {i}", f"{a} link {j}") for a in arms for i in links for j in links if j > i + 1}
    expected |= {(f"kingkong link {i}", f"wukong link {j}") for i in links for j in links}
    expected |= {(f"{a} link {i}", box) for a in arms for i in links for box in boxes}
    expected -= {("kingkong link 1", "body"), ("wukong link 1", "body")}
    assert set(model.pairs) == expected
    assert len(model.pairs) == len(expected)
