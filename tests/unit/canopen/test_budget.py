"""The bus budget against numbers worked out by hand."""

import pytest
from typer.testing import CliRunner

from axisync_schemas.cell import Cell, parse_cell
from axisync_service.canopen.budget import (
    LOAD_MAX,
    TPDO2_INTERVALS,
    budget,
    tpdo2_interval,
    tpdo2_start,
    worst_case_bits,
)
from axisync_service.main import app
from support.cells import eod_text

TEXT = eod_text()


def twelve_on_one_bus(text: str = TEXT) -> str:
    text = text.replace('bus = "wukong"', 'bus = "kingkong"')
    first = text.index('name = "wukong.1"')
    for node in range(1, 7):
        text = text[:first] + text[first:].replace(f"node_id = {node},", f"node_id = {node + 10},")
    return text


@pytest.mark.parametrize(("data_bytes", "bits"), [(0, 55), (1, 65), (6, 115), (8, 135)])
def test_worst_case_stuffing(data_bytes: int, bits: int) -> None:
    assert worst_case_bits(data_bytes) == bits


def test_six_axes_fit_one_bus() -> None:
    cell = parse_cell(TEXT)
    found = budget(cell, cell.buses[0])
    assert found.cyclic_s == pytest.approx(1445e-6)
    # (1445 + 6 * 115 / 8 + 135) bits in 2 ms, and 65 bits of 50 + 60 heartbeats a second
    assert found.load == pytest.approx(((1445 + 86.25 + 135) / 0.002 + 65 * 110) / 1e6)
    assert found.worst_cycle_s == pytest.approx((1445 + 115 + 7 * 65 + 2 * 135) * 1e-6)
    assert found.typical < found.load
    assert found.fits


def test_tpdo2_is_sent_as_often_as_there_is_room() -> None:
    cell = parse_cell(TEXT)
    assert tpdo2_interval(cell, cell.buses[0]) == 8
    slower = parse_cell(TEXT.replace("period_ms = 2.0", "period_ms = 4.0"))
    assert tpdo2_interval(slower, slower.buses[0]) == 1
    faster = parse_cell(TEXT.replace("period_ms = 2.0", "period_ms = 1.8"))
    assert tpdo2_interval(faster, faster.buses[0]) is None


def test_turns_are_spread_over_the_interval() -> None:
    assert [tpdo2_start(i, 6, 8) for i in range(6)] == [1, 2, 3, 5, 6, 7]
    for interval in TPDO2_INTERVALS:
        for drives in (1, 6, 12):
            slots = [tpdo2_start(i, drives, interval) for i in range(drives)]
            assert all(1 <= slot <= interval for slot in slots)
            assert max(slots.count(slot) for slot in slots) == -(-drives // interval)


def test_what_would_fit_does_and_one_more_does_not() -> None:
    cell = parse_cell(TEXT)
    found = budget(cell, cell.buses[0])
    assert (found.period_min_s, found.drives_max) == (pytest.approx(0.0019), 6)

    def load(period_ms: float) -> float:
        other = parse_cell(TEXT.replace("period_ms = 2.0", f"period_ms = {period_ms}"))
        return budget(other, other.buses[0]).load

    assert load(1.9) <= LOAD_MAX < load(1.8)


def test_twelve_axes_do_not_fit_one_bus() -> None:
    cell = parse_cell(twelve_on_one_bus())
    found = budget(cell, cell.buses[0])
    assert not found.fits
    assert found.tpdo2_interval is None
    assert found.period_min_s is not None
    longer = Cell.model_validate(cell.model_copy(update={"period": found.period_min_s}))
    assert budget(longer, longer.buses[0]).fits


def test_check_prints_it(tmp_path) -> None:  # type: ignore[no-untyped-def]
    file = tmp_path / "cell.toml"
    file.write_text(TEXT, encoding="utf-8")
    result = CliRunner().invoke(app, ["check", str(file)])
    assert result.exit_code == 0
    for words in ("1445 us", "1 in 8", "84.0%", "2285 us (114%)", "6 drives at 1.9 ms, or 6 drives at 2 ms"):
        assert words in result.output
    file.write_text(twelve_on_one_bus(), encoding="utf-8")
    result = CliRunner().invoke(app, ["check", str(file)])
    assert result.exit_code == 1
    assert "refused: over 85%" in result.output
