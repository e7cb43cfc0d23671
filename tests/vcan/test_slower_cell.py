"""The slower cell differs from the demo's in its times only, and keeps their proportions."""

import tomllib

import pytest

from axisync_schemas.cell import parse_cell
from vcan.slower_cell import EOD, HEARTBEATS, cell_text


@pytest.mark.parametrize("period_ms", [5.0, 20.0, 50.0])
def test_only_the_times_differ(period_ms: float) -> None:
    demo, slower = tomllib.loads(EOD.read_text()), tomllib.loads(cell_text(period_ms))
    assert slower.pop("period_ms") == period_ms
    demo.pop("period_ms")
    for name in HEARTBEATS:
        slower.pop(f"{name}_ms")
    assert slower == demo


def test_heartbeats_keep_their_proportion_to_the_period() -> None:
    demo, slower = parse_cell(EOD.read_text()), parse_cell(cell_text(20.0))
    for name in HEARTBEATS:
        ratios = getattr(slower, name) / slower.period, getattr(demo, name) / demo.period
        assert ratios[0] == pytest.approx(ratios[1], rel=1e-9)
