"""Why a tick is late: nobody woke the loop, or the cycle before it took too long, and with what. Pure."""

from dataclasses import dataclass

from axisync_schemas.enumerations import LateCause
from axisync_schemas.events import EventKind
from axisync_service.motion_controller.clock import Tick
from axisync_service.motion_controller.voice import Voice

LATE_SHARE = 0.05
"""Of a period: a wake-up later than this counts as late."""
BUDGET = {"read": 0.10, "decide": 0.20, "write": 0.10, "record": 0.10}
"""Of a period, by stage. Together with the time of the frames on the wire they fit into one."""
REPORT_S = 10.0
WORDS = {LateCause.SCHEDULER: "the scheduler", LateCause.OWN_CODE: "own code", LateCause.BUS: "a bus"}
_BUS_STAGES = ("read", "write")


@dataclass(frozen=True, slots=True)
class Spent:
    """Where the time of one executed cycle went, ns.

    Attributes:
        read: SYNC, and what the buses had; decide: the core; write: RPDOs and SDO; record: ring and reports.
        preempted: the processor was taken from the loop meanwhile (an involuntary context switch).
    """

    read: int
    decide: int
    write: int
    record: int
    preempted: bool

    @property
    def total(self) -> int:
        """ns"""
        return self.read + self.decide + self.write + self.record


@dataclass(frozen=True, slots=True)
class Blame:
    """Of one late tick: the cause, and the stage in which the time was lost if a cycle took too long."""

    cause: LateCause
    stage: str | None = None


class Lateness:
    """Counts late ticks by cause, and says so now and then.

    Attributes:
        causes: late ticks so far, those after skipped ones included.
    """

    def __init__(self, period_ns: int) -> None:
        self._late_ns = round(LATE_SHARE * period_ns)
        self._budget = {stage: round(share * period_ns) for stage, share in BUDGET.items()}
        self._period_ns, self._interval = period_ns, round(REPORT_S * 1e9 / period_ns)
        self.causes = dict.fromkeys(WORDS, 0)
        self._reported = dict(self.causes)
        self._before: Spent | None = None
        self._next_report = 0
        self._worst_ns, self._worst = 0, Blame(LateCause.NONE)

    def judge(self, tick: Tick) -> LateCause:
        """Of a tick, after the cycle that was noted last; NONE: it is in time."""
        late_ns = tick.lateness_ns + tick.skipped * self._period_ns
        if late_ns <= self._late_ns:
            return LateCause.NONE
        blame = self._blame(late_ns)
        self.causes[blame.cause] += 1
        if late_ns > self._worst_ns:
            self._worst_ns, self._worst = late_ns, blame
        return blame.cause

    def _blame(self, late_ns: int) -> Blame:
        before = self._before
        if before is None or before.total < self._period_ns:
            return Blame(LateCause.SCHEDULER)  # the loop was waiting again, and was not woken
        stage = max(self._budget, key=lambda name: int(getattr(before, name)) - self._budget[name])
        if before.preempted:
            return Blame(LateCause.SCHEDULER, stage)
        return Blame(LateCause.BUS if stage in _BUS_STAGES else LateCause.OWN_CODE, stage)

    def note(self, spent: Spent) -> None:
        """After each executed cycle."""
        self._before = spent

    def due(self, index: int) -> bool:
        """There is something to report, and the last report was long enough ago."""
        return self._worst_ns > 0 and index >= self._next_report

    def say(self, index: int, voice: Voice) -> None:
        """Reports what was late since the last report, and why."""
        counts = {cause: total - self._reported[cause] for cause, total in self.causes.items()}
        late, blame = sum(counts.values()), self._worst
        why = ", ".join(f"{count} by {WORDS[cause]}" for cause, count in counts.items() if count)
        stage = f" in {blame.stage}" if blame.stage else ""
        text = f"{late} ticks late: {why}; the worst by {self._worst_ns / 1e6:.2f} ms, {WORDS[blame.cause]}{stage}"
        causes = {cause.label: count for cause, count in counts.items()}
        worst = {"worst_us": self._worst_ns / 1e3, "worst_cause": blame.cause.label, "worst_stage": blame.stage}
        voice.say(EventKind.TICKS_LATE, text, None, "warning", late=late, causes=causes, **worst)
        self._reported = dict(self.causes)
        self._worst_ns, self._next_report = 0, index + self._interval
