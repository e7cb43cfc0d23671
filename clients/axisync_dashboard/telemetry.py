"""What is known of the daemon right now, and the frames that are made of it 20 times a second for all viewers alike."""

import json
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from axisync_client import Setpoints
from axisync_dashboard.decimation import Decimator, Histogram, Sample, rounded
from axisync_dashboard.ghosts import Ghost
from axisync_dashboard.texts import Texts, changes, texts_of
from axisync_schemas.cell import Cell
from axisync_schemas.replies import Event, Info, State

FRESH_S = 0.4
"""A state older than this is said to be stale, and greyed by the browser: 8 of them are missing."""
EVENTS_KEPT = 300
HISTOGRAM_EVERY = 20
"""Frames between two histograms."""


@dataclass(frozen=True)
class Frame:
    """One update: `changes` for who has the frame before, `full` for everyone else. Made once for all viewers."""

    number: int
    news: dict[str, Any]
    everything: dict[str, Any]

    @cached_property
    def changes(self) -> str:
        """What is different from the frame before, as JSON."""
        return _text(self.news)

    @cached_property
    def full(self) -> str:
        """Everything, as JSON."""
        return _text(self.everything)


@dataclass
class _Heard:
    """Since the frame before."""

    samples: list[Sample] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


class Telemetry:
    """Written by the link's threads, read by the page.

    Attributes:
        cell, info, state: of the daemon; None before it was ever there. `state` may be old: see `age_s`.
        trouble: why there is no connection, in a sentence; empty while there is one.
        generation: grows whenever the daemon comes with another cell file; pages of an older one load anew.
    """

    def __init__(self) -> None:
        self.cell: Cell | None = None
        self.info: Info | None = None
        self.state: State | None = None
        self.trouble = "Looking for the daemon."
        self.generation = 0
        self.events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._lock = threading.Lock()
        self._heard_s = time.monotonic()
        self._actual: list[float | None] = []
        self._errors: list[float | None] = []
        self._heard = _Heard()
        self._decimator, self._histogram = Decimator(), Histogram()
        self._ghosts: dict[str, Ghost] = {}
        self._ghost_moves: dict[str, str] = {}
        self._number = 0
        self._shown: Texts = {}
        self._counts: list[int] = []

    # Written by threads.

    def connected(self, cell: Cell, info: Info, state: State) -> None:
        """The daemon is there."""
        with self._lock:
            if cell != self.cell:
                self.generation += 1
            self.cell, self.info, self.trouble = cell, info, ""
            self._decimator, self._histogram = Decimator(), Histogram()
            self._ghosts, self._ghost_moves = {}, {}
        self.on_state(state)

    def lost(self, why: str) -> None:
        """The daemon is gone."""
        self.trouble = why

    def on_state(self, state: State) -> None:
        """A new state."""
        with self._lock:
            self.state, self._heard_s = state, time.monotonic()
            for group, move_id in list(self._ghost_moves.items()):
                if state.groups[group].move_id != move_id and state.groups[group].state != "moving":
                    del self._ghosts[group], self._ghost_moves[group]

    def on_setpoints(self, batch: Setpoints) -> None:
        """A new batch of ticks."""
        with self._lock:
            self._histogram.add(batch)
            self._heard.samples += self._decimator.add(batch)
            del self._heard.samples[:-100]
            if len(batch) > 1:
                self._actual = rounded(batch.position_actual[-1])
                self._errors = rounded(batch.position[-2] - batch.position_actual[-1])

    def on_event(self, event: Event) -> None:
        """Something happened."""
        with self._lock:
            self.events.append(event)
            self._heard.events.append(event)
            del self._heard.events[:-EVENTS_KEPT]

    def accepted(self, move_id: str, ghosts: dict[str, Ghost]) -> None:
        """A move begins: its path is shown until it is over."""
        with self._lock:
            for group, ghost in ghosts.items():
                self._ghosts[group], self._ghost_moves[group] = ghost, move_id

    # Read by the page.

    @property
    def age_s(self) -> float:
        """How long ago the state was heard."""
        return time.monotonic() - self._heard_s

    @property
    def fresh(self) -> bool:
        """The state is of now."""
        return not self.trouble and self.age_s < FRESH_S

    def frame(self) -> Frame:
        """The next frame."""
        with self._lock:
            self._number += 1
            texts = {} if self.state is None else texts_of(self.state, self._errors)
            common = self._common()
            heard, self._heard = self._heard, _Heard()
            counts = self._histogram.counts() if self._number % HISTOGRAM_EVERY == 1 else self._counts
            news: dict[str, Any] = {"x": changes(self._shown, texts)}
            if heard.samples:
                news["p"] = heard.samples
            if heard.events:
                news["e"] = [_event(event) for event in heard.events]
            if counts != self._counts:
                news["h"] = counts
            self._shown, self._counts = texts, counts
            everything = {"x": texts, "p": heard.samples, "h": counts, "e": [_event(e) for e in self.events], "all": 1}
        return Frame(self._number, {**common, **news}, {**common, **everything})

    def _common(self) -> dict[str, Any]:
        ghosts = {name: {"end": ghost.end, "path": ghost.path} for name, ghost in self._ghosts.items()}
        return {
            "n": self._number,
            "ok": self.fresh,
            "age": round(self.age_s, 2),
            "why": self.trouble,
            "cell": self.generation,
            "q": self._actual,
            "ghosts": ghosts,
        }


def _event(event: Event) -> list[str]:
    where = event.group or event.source
    return [event.wall_time[11:19], event.severity, where, event.kind.replace("_", " "), event.message]


def _text(content: dict[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)
