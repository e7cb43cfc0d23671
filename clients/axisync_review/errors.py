"""What can go wrong with a log, in one sentence each."""

import sys
from pathlib import Path

from axisync_client import AxisyncError, ErrorCode

GIVE_A_LOG = "give a log that axisync's recorder wrote, named by its cell and the time"


class LogUnreadable(AxisyncError):
    """The file is no log of axisync, or not one that this version can read."""

    code = ErrorCode.INVALID_REQUEST


def foreign(path: Path, profile: str) -> LogUnreadable:
    """An MCAP file, but of somebody else."""
    whose = f"profile {profile[:60]!r}" if profile else "no profile"
    return LogUnreadable(f"{path} is an MCAP file of another program ({whose})", GIVE_A_LOG)


class NotWritten(AxisyncError):
    """A result could not be written."""

    code = ErrorCode.UNAVAILABLE


class MissingExtra(AxisyncError):
    """A package of the extra `review` is not installed."""

    code = ErrorCode.UNAVAILABLE

    def __init__(self, what: str, package: str) -> None:
        fix = f"run `{sys.executable} -m pip install {package}` (the extra `review`)"
        super().__init__(f"{what} needs {package}, which is not installed", fix)
