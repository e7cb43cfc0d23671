"""Every command line of the documents is one: program, command, options and arguments. None is run."""

import re
from pathlib import Path

import pytest
import typer

from support.documents import PAGES, ROOT, command_lines, mentions, parsed

PLACEHOLDERS = {"COMMAND": "state", "...": "0"}
"""Words of the documents that stand for something which a parser looks at."""
LINES = [(page, words) for page in PAGES for words in command_lines(page)]
MENTIONS = [(page, words) for page in PAGES for words in mentions(page)]
CLIENTS = ROOT / "docs" / "clients.md"
UsageError: type[Exception] = typer.BadParameter.__mro__[1]


def name_of(case: object) -> str:
    return case.name if isinstance(case, Path) else " ".join(map(str, case if isinstance(case, list) else [case]))


def test_lines_are_found() -> None:
    assert {"README.md", "arms.md", "dashboard.md", "log.md", "realtime.md"} <= {page.name for page, _ in LINES}
    assert {"README.md", "clients.md", "drives.md", "safety.md"} <= {page.name for page, _ in MENTIONS}
    assert ["axisync", "override", "30%"] in [words for _, words in LINES]


@pytest.mark.parametrize(("page", "words"), LINES, ids=name_of)
def test_every_line_is_one(page: Path, words: list[str]) -> None:
    parsed(words)
    if words[:2] == ["axisync", "run"]:
        assert (ROOT / words[2]).is_file()


@pytest.mark.parametrize(("page", "words"), MENTIONS, ids=name_of)
def test_every_line_in_a_sentence_is_one(page: Path, words: list[str]) -> None:
    """Where it names only a command, there is such a command."""
    parsed([PLACEHOLDERS.get(word, word) for word in words] if words[2:] else [*words, "--help"])


def test_the_table_of_commands_has_only_commands() -> None:
    table = re.findall(r"^\| [a-z ]+ \| (`.*) \|$", CLIENTS.read_text(encoding="utf-8"), re.MULTILINE)
    shown = [line for row in table for line in re.findall(r"`([^`]*)`", row)]
    assert len(shown) > 15
    for line in shown:
        parsed(["axisync", *line.split()])


@pytest.mark.parametrize(
    "line", ["axisync move kingkong --joints 0", "axisync state all", "axisyncd run", "axisync-dashboard --ports 1"]
)
def test_others_are_not(line: str) -> None:
    with pytest.raises(UsageError, match=r"(?i)no such option|unexpected|missing"):
        parsed(line.split())
