"""Ticks that a log does not have, and why, as far as the log knows."""

from collections.abc import Iterator
from dataclasses import dataclass

from axisync_review.findings import Findings
from axisync_review.incidents import Evidence, Incident
from axisync_schemas.events import EventKind
from axisync_schemas.memory import RING_SECONDS
from axisync_schemas.replies import Event

AROUND_NS = 2_000_000_000
TOO_LATE = (
    f"the recorder came later than the {RING_SECONDS:g} s that the ring holds; "
    "give it processor time, and a disk that keeps up"
)
NOT_WRITTEN = "the controller never wrote them"
UNKNOWN = "the log does not say why; is a file of this run left out?"
TOLD_OF = (
    EventKind.RECORDER_LOST, EventKind.RECORDER_FAILING, EventKind.RECORDER_RECOVERED, EventKind.PROCESS_DIED,
    EventKind.LOG_OPENED,
)  # fmt: skip
"""What tells how it came to a gap."""


@dataclass(frozen=True, slots=True)
class Missing:
    """Ticks first..last. `log_time_ns` is that of the tick before, or of whoever said it; `told_ns` of the latter."""

    first: int
    last: int
    log_time_ns: int
    why: str
    told_ns: int | None

    @property
    def ticks(self) -> int:
        """How many."""
        return self.last - self.first + 1

    @property
    def text(self) -> str:
        """The whole sentence."""
        if self.ticks == 1:
            return f"tick {self.first} is missing: {self.why}"
        return f"{self.ticks} ticks are missing, {self.first} to {self.last}: {self.why}"


def missing(found: Findings) -> list[Missing]:
    """Gaps between the ticks of the log, and those before it of which its recorder says that no log has them."""
    said = list(_said(found))
    gaps = []
    for gap in found.run.gaps:
        told = [one for one in said if one.first <= gap.last and gap.first <= one.last]
        why, told_ns = (told[0].why, told[0].told_ns) if told else (UNKNOWN, None)
        gaps.append(Missing(gap.first, gap.last, gap.log_time_ns, why, told_ns))
    return [*(one for one in said if one.last < found.first_tick), *gaps]


def _said(found: Findings) -> Iterator[Missing]:
    for time, event in found.story.of_kind(EventKind.RECORDER_LOST):
        why = TOO_LATE if event.details.get("lost") else NOT_WRITTEN
        for first, last in _ranges(event):
            yield Missing(first, last, time, why, time)


def _ranges(event: Event) -> Iterator[tuple[int, int]]:
    """Of `details.ranges`: pairs of ticks; a file may hold anything."""
    ranges = event.details.get("ranges")
    for one in ranges if isinstance(ranges, list) else ():
        match one:
            case [int(first), int(last)] if 0 < first <= last:
                yield first, last


def gap_incidents(found: Findings) -> Iterator[Incident]:
    """Each gap with what was said around it."""
    for one in missing(found):
        incident = Incident("gap", one.log_time_ns, one.text, tick=one.first)
        end = one.log_time_ns if one.told_ns is None else one.told_ns
        incident.evidence = [
            Evidence(time, event.source, f"{event.kind}: {event.message}", event.tick)
            for time, event in found.story.of_kind(*TOLD_OF)
            if one.log_time_ns - AROUND_NS <= time <= end + AROUND_NS
        ]
        yield incident
