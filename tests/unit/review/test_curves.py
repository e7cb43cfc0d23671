"""Curves of the report lose no peak; histograms of lateness are right; the page needs nothing from elsewhere."""

import base64
import json
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from axisync_review import chunks, pieces, series
from axisync_review.findings import Findings, gather
from axisync_review.html_report import LEVELS, packed, page, quantised
from axisync_review.review import review_of
from axisync_review.timing import _longest
from axisync_schemas.ticks import Records
from support.command_line import Run
from support.logread import read_log
from support.saved_log import Maker, event


@pytest.mark.parametrize("buckets", [64, 100, 1000, 8192])
@pytest.mark.parametrize("rows", [97, 4096])
def test_buckets_keep_every_peak(good_log: Path, monkeypatch: pytest.MonkeyPatch, buckets: int, rows: int) -> None:
    """Each bucket has the least and greatest of exactly its ticks, whatever the pieces were."""
    alike = chunks._alike
    monkeypatch.setattr(series, "BUCKETS", buckets)
    monkeypatch.setattr(pieces, "PIECE_ROWS", rows)
    monkeypatch.setattr(chunks, "_alike", lambda *run: min(rows, alike(*run)))
    curves = gather([good_log], curves=True).series
    assert curves is not None
    ticks = read_log(good_log).ticks
    assert buckets / 2 - 1 <= curves.count <= buckets or curves.ticks == 1
    assert curves.count == -(-len(ticks) // curves.ticks)
    starts = np.arange(0, len(ticks), curves.ticks)
    for name in ("position", "jerk"):
        low, high = curves.envelope(name)
        assert (low == np.minimum.reduceat(ticks[name], starts)).all()
        assert (high == np.maximum.reduceat(ticks[name], starts)).all()
    assert (curves.poses == ticks["position"][starts]).all()
    assert (curves.states == ticks["group_state"][starts]).all()


def test_levels_are_as_near_as_they_can_be() -> None:
    values = np.random.default_rng(1).normal(size=(500, 3))
    values[:, 2] = 4.0
    least, greatest = values.min(axis=0), values.max(axis=0)
    raw = zlib.decompress(base64.b64decode(packed(quantised(values, least, greatest))))
    levels = np.cumsum(np.frombuffer(raw, "<u2").reshape(3, 500), axis=1, dtype=np.uint16)
    back = least + levels.T / LEVELS * (greatest - least)
    assert np.abs(back - values).max() <= 0.51 * (greatest - least).max() / LEVELS


def test_lateness(make: Maker) -> None:
    rng = np.random.default_rng(3)

    def edit(ticks: Records) -> None:
        ticks["lateness_ns"] = rng.lognormal(9.0, 1.5, len(ticks))
        ticks["skipped"][[50, 51, 200]] = 1
        ticks["lateness_ns"][50] = 10**9

    path = make.write(edit=edit)
    ticks, late = read_log(path).ticks, review_of(gather([path])).lateness
    values = ticks["lateness_ns"][ticks["skipped"] == 0] / 1e3
    for percent, found in ((50, late.p50_us), (99, late.p99_us), (99.9, late.p999_us)):
        assert found == pytest.approx(np.percentile(values, percent, method="higher"), rel=0.025)
    assert late.max_us == pytest.approx(values.max())
    assert sum(late.counts) == late.ticks == len(values)
    assert (late.skipped, late.skipped_in_a_row) == (3, 2)


@pytest.mark.parametrize(
    ("flags", "running", "expected"),
    [("0110", 0, (2, 0)), ("111", 2, (5, 5)), ("1011", 4, (5, 2)), ("000", 9, (9, 0)), ("0111", 0, (3, 3))],
)
def test_the_longest_run_over_pieces(flags: str, running: int, expected: tuple[int, int]) -> None:
    assert _longest(np.array([flag == "1" for flag in flags]), running) == expected


# --- the page -------------------------------------------------------------------------------------------------------


class Outside(HTMLParser):
    """Everything that a browser would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found += [f"{tag} {name}" for name, _ in attributes if name in ("src", "href", "srcset", "action")]


def drawn(path: Path) -> tuple[str, Findings]:
    found = gather([path], curves=True)
    return page(review_of(found), found), found


def data_of(text: str) -> dict:  # type: ignore[type-arg]
    match = re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert match is not None
    return dict(json.loads(match[1]))


def test_the_page_is_one_file(stopped_log: Path) -> None:
    text, _ = drawn(stopped_log)
    parser = Outside()
    parser.feed(text)
    assert parser.found == []
    assert not re.findall(r"https?://|@import|url\(", text)
    assert "/*css*/" not in text
    assert len(text) < 2_000_000


def test_the_page_has_the_curves(stopped_log: Path) -> None:
    text, found = drawn(stopped_log)
    data = data_of(text)
    assert found.series is not None
    assert data["count"] == found.series.count
    velocity = next(curve for curve in data["curves"] if curve["name"] == "velocity")
    assert velocity["limits"][0] == pytest.approx(30.0)
    assert max(velocity["greatest"]) == pytest.approx(np.degrees(found.series.envelope("velocity")[1].max()))
    assert data["review"]["moves"][0]["status"] == "stopped"
    assert data["states"][2] == "moving"


def test_the_tools_path_is_that_of_the_arm(stopped_log: Path) -> None:
    pytest.importorskip("pinocchio")
    from axisync_robot.arm import Arm

    text, found = drawn(stopped_log)
    kingkong, wukong = data_of(text)["paths"]
    arm = Arm.of(found.run.cell.groups[0])
    assert arm is not None
    first, last = (arm.forward(read_log(stopped_log).ticks["position"][row, :6])[0] for row in (0, -1))
    assert kingkong["points"][0] == pytest.approx(first, abs=1e-5)
    assert kingkong["points"][-1] == pytest.approx(last, abs=1e-5)
    assert len(wukong["points"]) == 1


def test_what_users_write_stays_text(make: Maker) -> None:
    """Whoever names a user or sends a request must not write into a colleague's report."""
    text, _ = drawn(make.write(more=[("/events", 5, event("emergency", 5, "</script><script>alert(1)</script>"))]))
    assert "</script><script>alert" not in text
    assert any("alert(1)" in one["message"] for one in data_of(text)["review"]["events"])


def test_a_page_without_ticks(make: Maker, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "report.html"
    assert run("review", make.write(span=slice(0, 0)), "--html", out).code == 1
    assert data_of(out.read_text("utf-8"))["t"] is None


def test_the_command(run: Run, good_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "report.html"
    shown = run("review", good_log, "--html", out)
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.splitlines()[0] == f"report in {out}"
    assert out.read_text("utf-8").startswith("<!doctype html>")
