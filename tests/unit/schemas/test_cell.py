"""The cell file: units, consistency, and refusals that name the line or the path."""

import math
from pathlib import Path

import pytest

from axisync_schemas.cell import Cell, CellError, override, parse_cell, read_cell
from support.cells import eod_text

TEXT = eod_text()


def test_eod_is_the_papers_robot() -> None:
    cell = parse_cell(TEXT)
    assert [len(group.axes) for group in cell.groups] == [6, 6]
    assert [axis.dh.d for axis in cell.groups[0].axes if axis.dh] == [0.1135, 0.0, 0.0, 0.0928, 0.1103, 0.0568]
    assert [axis.dh.a for axis in cell.groups[1].axes if axis.dh] == [0.0, -0.425, -0.3749, 0.0, 0.0, 0.0]
    limits = cell.axes[3].limits
    assert [math.degrees(x) for x in (limits.velocity, limits.acceleration, limits.jerk)] == pytest.approx([30, 40, 80])
    assert cell.period_ns == 2_000_000


def test_a_file_that_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "no.toml", "No such file or directory"), (tmp_path / "x.toml", "it is not UTF-8")):
        (tmp_path / "x.toml").write_bytes(b"\xff")
        with pytest.raises(CellError) as caught:
            read_cell(path)
        assert str(caught.value) == f"{path}: cannot be read: {why}"


def test_groups_and_their_axes() -> None:
    cell = parse_cell(TEXT)
    assert cell.members("both") == (0, 1)
    assert cell.members("all") == (0, 1)
    assert cell.axis_indices("wukong") == (6, 7, 8, 9, 10, 11)
    assert cell.axis_indices("both") == tuple(range(12))
    with pytest.raises(KeyError):
        cell.members("nobody")


def test_axes_override_their_groups_defaults() -> None:
    cell = parse_cell(TEXT.replace('name = "kingkong.3"', 'name = "kingkong.3"\nsoft_limits_deg = [-160, 10]'))
    assert [math.degrees(x) for x in cell.axes[2].soft_limits] == pytest.approx([-160, 10])
    assert [math.degrees(x) for x in cell.axes[0].soft_limits] == pytest.approx([-170, 170])


def test_json_round_trip_keeps_every_value() -> None:
    cell = parse_cell(TEXT)
    again = Cell.model_validate_json(cell.model_dump_json())
    assert again.axes[0].drive.counts_per_rad == cell.axes[0].drive.counts_per_rad
    assert again.axes[5].limits.jerk == pytest.approx(cell.axes[5].limits.jerk, rel=1e-15)


def test_simcan_takes_the_place_of_every_bus() -> None:
    cell = parse_cell(TEXT).on_simcan("/run/x")
    assert [(bus.interface, bus.channel) for bus in cell.buses] == [
        ("simcan", "/run/x/kingkong.sock"),
        ("simcan", "/run/x/wukong.sock"),
    ]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("period_ms = 2.0", "period_ms = = 2.0", "line 5"),
        ("period_ms = 2.0", "perod_ms = 2.0", "perod_ms: Extra inputs"),
        ("period_ms = 2.0", "", "period_ms: Field required"),
        ("period_ms = 2.0", "period_ms = inf", "period_ms"),
        ("period_ms = 2.0", "period_ms = nan", "period_ms"),
        ("period_ms = 2.0", "period_ms = -2.0", "greater than 0"),
        ("schema = 1", "schema = 2", "schema"),
        ("node_id = 2,", 'node_id = "2",', "groups[0].axes[1].drive.node_id"),
        ("node_id = 2,", "node_id = 3,", "kingkong:3 more than once"),
        ("node_id = 2,", "node_id = 127,", "groups[0].axes[1].drive.node_id"),
        ("jerk_deg_s3 = 240", "jerk_deg_s3 = 100", "at least 2 times"),
        ("soft_limits_deg = [-170, 170]", "soft_limits_deg = [-190, 170]", "inside hard_limits_deg"),
        ("emulator_start_deg = -150", "emulator_start_deg = -250", "outside hard_limits_deg"),
        ('bus = "kingkong"', 'bus = "king"', "is none of"),
        ('members = ["kingkong", "wukong"]', 'members = ["kingkong", "kong"]', "'kong' is none of"),
        ('name = "wukong.6"', 'name = "wukong.5"', "axes: wukong.5 more than once"),
        ('name = "both"', 'name = "all"', "cannot be called"),
        ("counts_per_turn = 1048576", "counts_per_turn = 0", "counts_per_turn"),
        ("direction = 1", "direction = 0", "direction"),
    ],
)
def test_refusals_name_the_place(old: str, new: str, said: str) -> None:
    assert old in TEXT
    with pytest.raises(CellError) as refusal:
        parse_cell(TEXT.replace(old, new, 1), "cell.toml")
    assert said in str(refusal.value)
    assert str(refusal.value).startswith("cell.toml: ")


def test_override_sets_top_level_keys_and_leaves_the_rest() -> None:
    text = override(TEXT, {"missed_ticks_max": 50, "tpdo_missed_max": 7})
    cell = parse_cell(text)
    assert (cell.missed_ticks_max, cell.tpdo_missed_max) == (50, 7)
    assert parse_cell(override(text, {"missed_ticks_max": 5, "tpdo_missed_max": 3})).axes == parse_cell(TEXT).axes
    assert override(text, {"missed_ticks_max": 50, "tpdo_missed_max": 7}) == text


def test_syntax_error_at_the_end_has_a_line() -> None:
    with pytest.raises(CellError, match="line 1"):
        parse_cell("name = ")
