"""The bench of arms runs, on little, with and without what it compares with."""

import io

import arms
import pytest
import retimed
from report import Report
from rich.console import Console


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arms, "POSES", 200)
    monkeypatch.setattr(arms, "FEW", 20)
    monkeypatch.setattr(arms, "STEP_S", 0.5)
    monkeypatch.setattr(retimed, "LINES", retimed.LINES[:2])


def measured() -> tuple[dict[str, object], str]:
    printed = io.StringIO()
    report = Report(Console(file=printed, width=120))
    arms.measure(report, rounds=1)
    return report.data, printed.getvalue()


def test_with_everything() -> None:
    pytest.importorskip("toppra")
    data, printed = measured()
    plans, lines = data["arms plans"], data["arms durations"]
    assert isinstance(plans, dict)
    assert isinstance(lines, list)
    assert any("TOPP-RA" in row for row in plans)
    assert "closed form" in printed
    for line in lines:
        best, *others = (
            float(line[key]) for key in ("TOPP-RA, V, A", "V, A of joints", "V, A, J of joints", "as asked")
        )
        assert best <= min(others)
        assert others == sorted(others)


def test_without_toppra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retimed, "import_module", lambda name: __import__("no_such_module"))
    data, _ = measured()
    plans = data["arms plans"]
    assert isinstance(plans, dict)
    assert not any("TOPP-RA" in row for row in plans)
