"""The demo's cell at another period: user-mode Linux has one CPU, and a frame takes up to a millisecond there."""

import re
from pathlib import Path

from axisync_schemas.cell import Cell, parse_cell

EOD = Path(__file__).parents[2] / "service" / "axisync_service" / "cells" / "eod.toml"
HEARTBEATS = ("controller_heartbeat", "controller_heartbeat_timeout", "drive_heartbeat", "drive_heartbeat_timeout")


def cell_text(period_ms: float, source: Path = EOD) -> str:
    """The cell file's text with another period and every heartbeat time stretched by as much.

    Raises:
        ValueError: the text has no period, or sets a heartbeat time already.
        CellError: the text that comes out is refused.
    """
    text = source.read_text()
    before = parse_cell(text, str(source))
    if any(f"{name}_ms" in text for name in HEARTBEATS):
        raise ValueError(f"{source} sets heartbeat times: stretch them there")
    stretched = "".join(f"{name}_ms = {_stretched(before, name, period_ms):g}\n" for name in HEARTBEATS)
    slower, count = re.subn(r"^period_ms = .*\n", f"period_ms = {period_ms:g}\n{stretched}", text, flags=re.MULTILINE)
    if count != 1:
        raise ValueError(f"{source}: {count} lines set period_ms")
    parse_cell(slower, f"{source} at {period_ms:g} ms")
    return slower


def _stretched(cell: Cell, name: str, period_ms: float) -> float:
    seconds: float = getattr(cell, name)
    return seconds * period_ms / cell.period
