"""The planner's bench runs with and without what it compares with."""

import io

import planner
import pytest
from report import Report
from rich.console import Console


def measured() -> tuple[dict[str, object], str]:
    printed = io.StringIO()
    report = Report(Console(file=printed, width=120))
    planner.measure(report, moves=60, batch=200, rounds=2)
    return report.data, printed.getvalue()


def test_with_everything() -> None:
    pytest.importorskip("ruckig")
    pytest.importorskip("numba")
    data, printed = measured()
    moves = data["planner moves"]
    assert isinstance(moves, dict)
    assert list(moves) == ["numba", "python", planner.RUCKIG, planner.RUCKIG_ALONE, "unit"]
    assert moves["python"]["samples"] == 60
    assert moves[planner.RUCKIG][f"/ {planner.RUCKIG}"] == "1.00"
    assert "planning with numba and python, beside Ruckig" in printed
    assert "rate_tables, numba" in printed


def test_without_ruckig_and_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planner, "import_module", lambda name: __import__("no_such_module"))
    monkeypatch.setattr(planner, "usable_backends", lambda: ["python"])
    data, printed = measured()
    batches = data["planner batches"]
    assert isinstance(batches, dict)
    assert list(batches) == ["python", "unit"]
    assert "planning with python, without Ruckig" in printed
    assert "install the extra `fast`" in printed
