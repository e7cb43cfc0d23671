"""The bus budget against design numbers worked out by hand."""

from importlib import resources

import pytest

from axisync_schemas.cell import parse_cell
from axisync_service.canopen.budget import budget, worst_case_bits

TEXT = resources.files("axisync_service").joinpath("cells/eod.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(("data_bytes", "bits"), [(0, 55), (1, 65), (6, 115), (8, 135)])
def test_worst_case_stuffing(data_bytes: int, bits: int) -> None:
    assert worst_case_bits(data_bytes) == bits


def test_six_axes_fit_one_bus() -> None:
    cell = parse_cell(TEXT)
    found = budget(cell, cell.buses[0])
    assert found.cyclic_s == pytest.approx(1445e-6)
    assert found.fits


def test_twelve_axes_do_not_fit_one_bus() -> None:
    text = TEXT.replace('bus = "wukong"', 'bus = "kingkong"')
    for node in range(1, 7):
        text = text[: text.index('name = "wukong.1"')] + text[text.index('name = "wukong.1"') :].replace(
            f"node_id = {node},", f"node_id = {node + 10},"
        )
    cell = parse_cell(text)
    assert not budget(cell, cell.buses[0]).fits
