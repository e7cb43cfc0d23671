"""The bench of the review runs, on a log that the review itself calls good."""

import io
from pathlib import Path

import pytest
import review
from report import Report
from rich.console import Console


def test_it_measures(tmp_path: Path) -> None:
    pytest.importorskip("mcap_protobuf")
    printed = io.StringIO()
    report = Report(Console(file=printed, width=200))
    review.measure(report, tmp_path, ticks=6_000, plain_ticks=500)
    found = report.data["review"]
    assert isinstance(found, dict)
    assert found["ticks"] == 6_000
    assert 10.0 < found["memory_mib"] < 500.0
    assert found["plain_us_a_tick"] > 1.0
    assert "times as long" in printed.getvalue()
