"""What the cell file may say about a drive, and what it refuses with its place."""

import math

import pytest

from axisync_schemas.cell import Cell, CellError, parse_cell
from axisync_schemas.cell_drive import object_key
from support.cells import eod_text

TEXT = eod_text()


def with_keys(keys: str) -> Cell:
    return parse_cell(TEXT.replace("drive = { node_id = 1,", f"drive = {{ {keys}, node_id = 1,", 1))


def test_units_are_si_inside() -> None:
    speeds = "switch_speed_deg_s = 90, zero_speed_deg_s = 9, acceleration_deg_s2 = 45"
    drive = with_keys(f"torque_max_percent = 80, homing = {{ method = 24, {speeds} }}").axes[0].drive
    assert drive.torque_max == pytest.approx(0.8)
    assert drive.homing is not None
    assert drive.homing.switch_speed == pytest.approx(math.pi / 2)
    assert drive.homing.acceleration == pytest.approx(math.pi / 4)


def test_what_is_sent_can_be_read_back() -> None:
    cell = with_keys('encoder = "incremental", homing = { method = 35 }')
    again = Cell.model_validate_json(cell.model_dump_json())
    assert again.axes[0].drive == cell.axes[0].drive
    assert again.axes[1].drive.torque_max is None


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('encoder = "incremental"', "an incremental encoder forgets where it is"),
        ("homing = { method = 0 }", "homing.method 0 is no homing"),
        ("homing = { method = 24 }", "so it needs switch_speed_deg_s, zero_speed_deg_s and acceleration_deg_s2"),
        ("homing = { method = 200 }", "homing.method"),
        ("torque_max_percent = 0", "torque_max_percent"),
        ("units = { speed_counts_s = -1 }", "units.speed_counts_s"),
        ('monitor = { voltage = { object = "6079" } }', "is no object"),
        ('monitor = { pressure = { object = "0x6079" } }', "pressure"),
    ],
)
def test_what_is_wrong_is_named(keys: str, words: str) -> None:
    with pytest.raises(CellError, match=r"groups.0..axes.0..drive") as refused:
        with_keys(keys)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("text", "key"), [("0x6079", (0x6079, 0)), ("0x2000:1", (0x2000, 1)), ("0x1a00:0x0A", (0x1A00, 10))]
)
def test_objects(text: str, key: tuple[int, int]) -> None:
    assert object_key(text) == key
