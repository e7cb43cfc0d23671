"""Log files of a daemon on this machine, and their review in a process of its own."""

import asyncio
import contextlib
import importlib.util
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

REVIEW_TIMEOUT_S = 120.0


@dataclass(frozen=True)
class LogFile:
    """One file; the newest is the one being written."""

    name: str
    size: int
    modified_s: float


def log_files(directory: str) -> list[LogFile] | None:
    """The newest first; None where there is no such directory here."""
    try:
        paths = list(Path(directory).glob("*.mcap"))
        if not Path(directory).is_dir():
            return None
    except OSError:
        return None
    files = []
    for path in paths:
        with contextlib.suppress(OSError):
            status = path.stat()
            files.append(LogFile(path.name, status.st_size, status.st_mtime))
    return sorted(files, key=lambda file: file.modified_s, reverse=True)


def path_of(directory: str, name: str) -> Path | None:
    """The file of that name; None for whatever is not a log file right there."""
    known = log_files(directory) or []
    return Path(directory) / name if any(file.name == name for file in known) else None


def can_review() -> bool:
    """The review is installed."""
    return importlib.util.find_spec("axisync_review") is not None


async def review(log: Path) -> str | None:
    """The report as HTML; None where the review does not come to one."""
    with tempfile.TemporaryDirectory() as directory:
        report = Path(directory) / "report.html"
        command = [sys.executable, "-m", "axisync_cli.main", "review", str(log), "--html", str(report)]
        process = await asyncio.create_subprocess_exec(
            *command, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL
        )
        try:
            await asyncio.wait_for(process.wait(), REVIEW_TIMEOUT_S)
        except TimeoutError:
            process.kill()
            await process.wait()
        # Exit code 1 is a verdict about the log, not about the review.
        return report.read_text(encoding="utf-8") if report.exists() else None
