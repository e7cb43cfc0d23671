"""The slower cell differs from its original in its times only, and keeps their proportions."""

import tomllib

import pytest

from axisync_schemas.cell import parse_cell
from support.cells import eod_text
from support.daemon import patient
from vcan.slower_cell import HEARTBEATS, slower

TEXTS = pytest.mark.parametrize("text", [eod_text(), patient(eod_text())], ids=["demo", "patient"])


@TEXTS
@pytest.mark.parametrize("period_ms", [5.0, 20.0, 50.0])
def test_only_the_times_differ(text: str, period_ms: float) -> None:
    times = {"period_ms", *(f"{name}_ms" for name in HEARTBEATS)}
    before, after = tomllib.loads(text), tomllib.loads(slower(text, period_ms))
    assert after["period_ms"] == period_ms
    assert {k: v for k, v in after.items() if k not in times} == {k: v for k, v in before.items() if k not in times}


@TEXTS
def test_heartbeats_keep_their_proportion_to_the_period(text: str) -> None:
    before, after = parse_cell(text), parse_cell(slower(text, 20.0))
    for name in HEARTBEATS:
        ratios = getattr(after, name) / after.period, getattr(before, name) / before.period
        assert ratios[0] == pytest.approx(ratios[1], rel=1e-8)
