"""Names of log files: `<cell>-<yyyymmddThhmmssZ>.mcap`, and `faults/<cell>-<time>-fault-<what>.mcap` for extracts."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

FAULTS = "faults"
"""Folder of the extracts, so that nobody takes them for more of the same session."""
SUFFIX = ".mcap"
_STAMP = r"(?P<stamp>\d{8}T\d{6}Z)"
_REST = r"(?:-fault-(?P<what>[a-z0-9_]+))?(?:-(?P<number>[0-9]{1,6}))?"


@dataclass(frozen=True, slots=True, order=True)
class LogName:
    """A log file's name in parts; names sort by time, and by `number` where several share a second."""

    stamp: str
    number: int
    cell: str
    fault: str = ""

    def __str__(self) -> str:
        fault = f"-fault-{self.fault}" if self.fault else ""
        number = f"-{self.number}" if self.number > 1 else ""
        return f"{self.cell}-{self.stamp}{fault}{number}{SUFFIX}"

    @classmethod
    def parse(cls, cell: str, name: str) -> Self | None:
        """The parts of a log file's name of `cell`; None where it is none: files of others are not ours to touch."""
        match = re.fullmatch(rf"{re.escape(cell)}-{_STAMP}{_REST}{re.escape(SUFFIX)}", name)
        if match is None:
            return None
        found = cls(match["stamp"], int(match["number"] or 1), cell, match["what"] or "")
        return found if str(found) == name else None

    def path(self, directory: Path) -> Path:
        """Where it belongs below the directory of logs."""
        return directory / FAULTS / str(self) if self.fault else directory / str(self)
