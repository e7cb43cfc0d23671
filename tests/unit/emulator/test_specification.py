"""From the cell file to counts."""

import math
from pathlib import Path

import pytest

from axisync_emulator.drive.specification import specify
from axisync_schemas.cell import Axis, parse_cell

CELL_FILE = Path(__file__).parents[3] / "service/axisync_service/cells/eod.toml"


def axis(**changes: object) -> Axis:
    axis = parse_cell(CELL_FILE.read_text()).axes[1]
    return axis.model_copy(update={"drive": axis.drive.model_copy(update=changes)})


def test_start_follows_the_drives_mapping():
    # counts = direction * (position - offset) * counts_per_turn * gear_ratio / (2 pi)
    drive = specify(axis(direction=-1, offset=math.radians(10), gear_ratio=2.0, counts_per_turn=3600), 0)
    assert drive.start == pytest.approx(-(-150 - 10) * 3600 * 2 / 360)


def test_limits_in_counts_are_positive_whatever_the_direction():
    forward, backward = specify(axis(), 0), specify(axis(direction=-1), 0)
    assert forward.deceleration == backward.deceleration == 262_144
    assert forward.rated_acceleration == 4 * 262_144
    low, high = (degrees / 360 * 2**20 for degrees in (-210, 180))
    assert forward.limit_switches == pytest.approx((low, high))
    assert backward.limit_switches == pytest.approx((-high, -low))
    assert forward.speed_limit == backward.speed_limit == pytest.approx(1.5 * 30 / 360 * 2**20)
    assert forward.enable_window == pytest.approx(2 / 360 * 2**20)
    assert forward.brake_release_ns == 60_000_000


def test_serial_numbers_differ_between_buses_and_nodes():
    cell = parse_cell(CELL_FILE.read_text())
    numbers = {specify(axis, bus).serial for bus in (0, 1) for axis in cell.axes[:6]}
    assert len(numbers) == 12
