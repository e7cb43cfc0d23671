"""Logs that are read a few ticks at a time: what a reader finds must not depend on how much comes at once."""

from collections.abc import Iterator

import pytest

from axisync_review import pieces
from axisync_review.log_file import LogFile, Message, Rows


def crumble(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    """From now on no piece has more than `rows` ticks."""
    whole = LogFile.parts

    def parts(self: LogFile, ticks: bool = True) -> Iterator[Rows | Message]:
        for part in whole(self, ticks):
            if isinstance(part, Message):
                yield part
            else:
                yield from (part[begin : begin + rows] for begin in range(0, len(part), rows))

    monkeypatch.setattr(LogFile, "parts", parts)
    monkeypatch.setattr(pieces, "PIECE_ROWS", rows)
