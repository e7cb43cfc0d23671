"""The soak's table: growth by the hour, and a grid that is judged from the ticks."""

import io
from itertools import count
from typing import Any

import numpy as np
import pytest
import soak
from processes import Usage
from report import Report
from rich.console import Console

from axisync_schemas.ticks import TickLayout


def test_growth_is_said_by_process_and_hour(monkeypatch: pytest.MonkeyPatch) -> None:
    now = count(0.0, 10.0)
    monkeypatch.setattr("soak.time.monotonic", lambda: next(now))
    sizes = count(50.0, 0.1)
    growth = soak.Growth(lambda: [Usage("front", 1, 0.0, next(sizes), 3)], 100.0, _began=0.0)
    for _ in range(12):
        growth.poll()
    ticks = np.repeat(TickLayout(1, 1).new().reshape(1), 50)
    ticks["tick"] = np.arange(1, 51)
    ticks["cycle_start_ns"] = ticks["tick"] * 2_000_000
    output = io.StringIO()
    report = Report(Console(file=output, width=110))
    growth.say(report, ticks, 2_000_000)
    assert "off by at most 0 ns" in output.getvalue()
    rows: Any = report.data["soak"]
    (row,) = rows
    assert row["process"] == "front"
    assert float(row["an hour, from half-way on"]) == pytest.approx(36.0, rel=0.05)
