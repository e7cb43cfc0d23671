"""What `axisync watch` draws: as much of the state as fits into a terminal, what happened, and when it falls silent."""

import time
from collections import deque
from collections.abc import Iterable

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from axisync_cli.event_line import event_line
from axisync_cli.state_table import live_table
from axisync_client import Stream, Unavailable
from axisync_schemas.replies import Event, State

DRAWN_EVERY_S = 0.1
NEWEST = 6
"""Events shown below the state."""


def draw(out: Console, states: Stream[State], news: Stream[Event], past: Iterable[Event]) -> None:
    """Draws until Ctrl-C. A daemon that goes away is said, and waited for."""
    shown = deque(past, NEWEST)
    report: State | None = None
    drawn_s = 0.0
    with Live(console=out, auto_refresh=False, screen=out.is_terminal) as live:
        while True:
            try:
                report, silence = next(states), None
            except StopIteration:
                return
            except Unavailable as error:
                if report is None:
                    raise
                silence = error.message
            while (event := news.poll()) is not None:
                shown.append(event)
            if silence or time.monotonic() - drawn_s >= DRAWN_EVERY_S:
                live.update(frame(report, shown, silence), refresh=True)
                drawn_s = time.monotonic()


def frame(report: State, shown: Iterable[Event], silence: str | None) -> RenderableType:
    """One picture; `silence` says why the state is an old one."""
    old = [] if silence is None else [Text(f"{silence}: the state below is old, waiting for it", style="bold red")]
    lines = [event_line(event) for event in shown]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return Group(*old, live_table(report), *lines)
