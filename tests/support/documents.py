"""What README and docs have a user type: command lines, and Python."""

import re
import shlex
from pathlib import Path
from typing import Any

import typer

from axisync_cli.main import app as axisync
from axisync_dashboard.main import app as dashboard
from axisync_emulator.main import app as emulator
from axisync_service.main import app as axisyncd

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")), *sorted(ROOT.glob("deploy/*.md")))
APPS = {"axisync": axisync, "axisyncd": axisyncd, "axisync-dashboard": dashboard, "axisync-emulator": emulator}
_PROGRAM = r"(?:\.venv/bin/)?((?:axisyncd|axisync-dashboard|axisync-emulator|axisync) "
_LINE = re.compile(rf"^(?:sudo )?{_PROGRAM}.*)$", re.MULTILINE)
_INLINE = re.compile(rf"`{_PROGRAM}[^`]*)`")
_PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)


def python_blocks(page: Path) -> list[str]:
    """Python of a page, in order."""
    return _PYTHON.findall(page.read_text(encoding="utf-8"))


def command_lines(page: Path) -> list[list[str]]:
    """Words of each line that is a command line; it ends at two blanks, where a remark follows, or at `#`."""
    lines = _LINE.findall(page.read_text(encoding="utf-8"))
    return [shlex.split(re.split(r"\s{2,}", line)[0], comments=True) for line in lines]


def mentions(page: Path) -> list[list[str]]:
    """Words of each command line within a sentence."""
    return [shlex.split(line) for line in _INLINE.findall(page.read_text(encoding="utf-8"))]


def parsed(words: list[str]) -> dict[str, Any]:
    """Arguments and options of one command line, which is not run.

    Raises:
        typer's usage errors; KeyError for a command that there is not.
    """
    command: Any = typer.main.get_command(APPS[words[0]])
    rest = words[1:]
    if hasattr(command, "commands") and not rest[0].startswith("-"):
        command = command.commands[rest.pop(0)]
    if rest[:1] in (["--help"], ["--install-completion"]):
        return {}
    return dict(command.make_context(words[0], rest).params)
