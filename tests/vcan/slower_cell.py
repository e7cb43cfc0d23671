"""A cell at another period: user-mode Linux has one CPU, and a frame takes up to a millisecond there."""

import re

from axisync_schemas.cell import parse_cell

HEARTBEATS = ("controller_heartbeat", "controller_heartbeat_timeout", "drive_heartbeat", "drive_heartbeat_timeout")
_TIMES = re.compile(rf"^(?:{'|'.join((*HEARTBEATS, 'period'))})_ms = .*\n", flags=re.MULTILINE)


def slower(text: str, period_ms: float) -> str:
    """The cell file's text with another period and every heartbeat time, set there or not, stretched by as much.

    Raises:
        CellError: either text is refused.
    """
    before = parse_cell(text)
    stretch = period_ms / (before.period * 1e3)
    times = {"period": period_ms, **{name: getattr(before, name) * 1e3 * stretch for name in HEARTBEATS}}
    lines = "".join(f"{name}_ms = {value:.9g}\n" for name, value in times.items())
    # Keys of the whole file come before the first table.
    result = lines + _TIMES.sub("", text)
    parse_cell(result)
    return result
