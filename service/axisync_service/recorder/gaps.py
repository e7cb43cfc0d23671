"""Ticks that the log will not have: runs of them, and one report a second at most."""

from dataclasses import dataclass, field

INTERVAL_NS = 1_000_000_000
LOST = "the ring held them no longer when the recorder came (it needs processor time, and a disk that keeps up)"
NEVER_WRITTEN = "the controller never wrote them"
NAMED = 16
"""Gaps whose ticks a report names; the rest are counted."""


@dataclass(slots=True)
class Gap:
    """Ticks first..last in a row that the log will not have; `lost`: the ring had them, and has them no longer."""

    first: int
    last: int
    lost: bool

    @property
    def ticks(self) -> int:
        """How many."""
        return self.last - self.first + 1


@dataclass(slots=True)
class GapReport:
    """Gaps since the last report, and when that was."""

    gaps: list[Gap] = field(default_factory=list)
    _more: int = 0
    _last_ns: int | None = None

    def add(self, gap: Gap) -> None:
        """Notes a gap; one that goes on where the last one ended is the same gap."""
        if self.gaps and self.gaps[-1].last == gap.first - 1 and self.gaps[-1].lost == gap.lost:
            self.gaps[-1].last = gap.last
        elif len(self.gaps) < NAMED:
            self.gaps.append(gap)
        else:
            self._more += gap.ticks

    def take(self, now_ns: int, at_once: bool = False) -> tuple[str, dict[str, object]] | None:
        """A sentence and an event's details, where there is something to say and it is time to."""
        early = self._last_ns is not None and now_ns - self._last_ns < INTERVAL_NS
        if not self.gaps or (early and not at_once):
            return None
        lost = sum(gap.ticks for gap in self.gaps if gap.lost)
        never = sum(gap.ticks for gap in self.gaps if not gap.lost)
        ranges, more = [[gap.first, gap.last] for gap in self.gaps], self._more
        details: dict[str, object] = {"lost": lost, "never_written": never, "ranges": ranges, "more": more}
        self.gaps, self._more, self._last_ns = [], 0, now_ns
        return _sentence(lost, never, more), details


def _sentence(lost: int, never: int, more: int) -> str:
    given = [(ticks, why) for ticks, why in ((lost, LOST), (never, NEVER_WRITTEN)) if ticks]
    whys = [why for _, why in given] if len(given) == 1 else [f"of {ticks}, {why}" for ticks, why in given]
    return f"{lost + never + more} ticks are missing from the log: {'; '.join(whys)}"
