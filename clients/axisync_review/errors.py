"""What can go wrong with a log, in one sentence each."""

import sys

from axisync_client import AxisyncError, ErrorCode


class LogUnreadable(AxisyncError):
    """The file is no log of axisync, or not one that this version can read."""

    code = ErrorCode.INVALID_REQUEST


class NotWritten(AxisyncError):
    """A result could not be written."""

    code = ErrorCode.UNAVAILABLE


class MissingExtra(AxisyncError):
    """A package of the extra `review` is not installed."""

    code = ErrorCode.UNAVAILABLE

    def __init__(self, what: str, package: str) -> None:
        fix = f"run `{sys.executable} -m pip install {package}` (the extra `review`)"
        super().__init__(f"{what} needs {package}, which is not installed", fix)
