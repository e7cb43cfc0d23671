"""Tables and examples of docs/planner.md are what they say they are."""

import re
from pathlib import Path
from types import ModuleType

import pytest

PAGE = (Path(__file__).parents[3] / "docs" / "planner.md").read_text()
NUMBER = re.compile(r"(?<![\w^.-])\d+(?:\.\d+)?")


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(code, "planner.md", "exec"), {})
    assert capsys.readouterr().out.startswith("5.25\n")


@pytest.mark.parametrize("name", ["mappings", "distances"])
def test_table_is_current(script: ModuleType, name: str) -> None:
    """Words are equal, numbers within one unit of their last digit: run docs/draw_figures.py after a change."""
    shown, computed = script.table_in(PAGE, name), script.TABLES[name]()
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", computed)
    for one, other in zip(NUMBER.findall(shown), NUMBER.findall(computed), strict=True):
        digits = len(one.partition(".")[2])
        assert float(one) == pytest.approx(float(other), abs=1.01 * 10.0**-digits if digits else 0.0)


def test_every_mark_has_its_table(script: ModuleType) -> None:
    assert PAGE.count("written by make figures -->") == len(script.TABLES)
    assert PAGE.count("<!-- end -->") == len(script.TABLES)


def test_links_within_the_page_lead_somewhere() -> None:
    headings = {
        re.sub(r"[^\w -]", "", line.lower()).strip().replace(" ", "-") for line in re.findall(r"^#+ (.*)", PAGE, re.M)
    }
    links = re.findall(r"\]\(#([^)]*)\)", re.sub(r"\]\s*\(", "](", PAGE))
    assert links
    assert set(links) <= headings
